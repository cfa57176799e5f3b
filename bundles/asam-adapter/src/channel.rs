//! Message channel between the bus process and a runner: packets on a socket pair.
//!
//! A message has a number, a JSON head and a body of bytes. It is cut into packets that arrive
//! completely or are lost completely. If a bus process is killed in the middle of a message,
//! another one continues on the same sockets. The receiver drops an incomplete message as soon as a
//! packet of another message arrives.

use std::io::{self, ErrorKind};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use rustix::net::{AddressFamily, SocketFlags, SocketType, socketpair};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Size of a packet in bytes, including its own head of [`HEAD`] bytes.
const PACKET: usize = 64 << 10;
/// Size of the packet head: message number, head size, body size, and bytes sent before.
const HEAD: usize = 32;

/// One end of a channel.
#[derive(Debug)]
pub(crate) struct Channel {
    socket: OwnedFd,
}

/// A complete message.
#[derive(Debug)]
pub(crate) struct Message {
    /// Number of the message. The answer repeats it.
    pub number: u64,
    head: Vec<u8>,
    /// Bytes that follow the head.
    pub body: Vec<u8>,
}

impl Message {
    /// Parses the head.
    ///
    /// # Errors
    /// If the head does not have the expected type.
    pub fn head<T: DeserializeOwned>(&self) -> io::Result<T> {
        serde_json::from_slice(&self.head)
            .map_err(|error| io::Error::new(ErrorKind::InvalidData, error))
    }
}

impl Channel {
    /// Creates both ends of a channel. They are closed when the process executes another program.
    ///
    /// # Errors
    /// System errors.
    pub fn pair() -> io::Result<(Channel, Channel)> {
        let (one, other) = socketpair(
            AddressFamily::UNIX,
            SocketType::SEQPACKET,
            SocketFlags::CLOEXEC,
            None,
        )?;
        Ok((Channel { socket: one }, Channel { socket: other }))
    }

    /// Creates an end from a socket that another process passed on.
    pub fn from_socket(socket: OwnedFd) -> Channel {
        Channel { socket }
    }

    /// Returns the socket to pass it on.
    pub fn into_socket(self) -> OwnedFd {
        self.socket
    }

    /// Sends a message. Its body is the concatenation of the given pieces.
    ///
    /// # Errors
    /// System errors; [`ErrorKind::BrokenPipe`] if the other end is closed.
    pub fn send(&self, number: u64, head: &impl Serialize, body: &[&[u8]]) -> io::Result<()> {
        let head = serde_json::to_vec(head)?;
        let length: usize = body.iter().map(|it| it.len()).sum();
        let lengths = [head.len() as u64, length as u64];
        let mut pieces = std::iter::once(&head[..]).chain(body.iter().copied());
        let mut piece = pieces.next().unwrap_or_default();
        let mut before = 0_u64;
        let mut packet = Vec::with_capacity(PACKET);
        loop {
            packet.clear();
            for word in [number, lengths[0], lengths[1], before] {
                packet.extend_from_slice(&word.to_le_bytes());
            }
            while packet.len() < PACKET {
                if piece.is_empty() {
                    match pieces.next() {
                        Some(next) => piece = next,
                        None => break,
                    }
                    continue;
                }
                let (now, later) = piece.split_at(piece.len().min(PACKET - packet.len()));
                packet.extend_from_slice(now);
                piece = later;
            }
            before += (packet.len() - HEAD) as u64;
            self.write(&packet)?;
            if before == lengths[0] + lengths[1] {
                return Ok(());
            }
        }
    }

    fn write(&self, packet: &[u8]) -> io::Result<()> {
        // `send` is not needed: Rust programs ignore the signal for a closed pipe.
        loop {
            match rustix::io::write(&self.socket, packet) {
                Ok(_) => return Ok(()),
                Err(rustix::io::Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// Waits for a message. Returns `None` if the other end is closed.
    ///
    /// # Errors
    /// System errors; [`ErrorKind::InvalidData`] for an invalid packet or more than `most` bytes.
    pub fn receive(&self, most: u64) -> io::Result<Option<Message>> {
        let mut packet = vec![0; PACKET];
        let mut begun: Option<(Message, u64, usize)> = None;
        loop {
            let length = match rustix::io::read(&self.socket, &mut packet[..]) {
                Ok(0) | Err(rustix::io::Errno::CONNRESET) => return Ok(None),
                Ok(length) => length,
                Err(rustix::io::Errno::INTR) => continue,
                Err(error) => return Err(error.into()),
            };
            let invalid = |why: &str| io::Error::new(ErrorKind::InvalidData, why);
            let parts = packet[..length].split_first_chunk::<HEAD>();
            let (words, content) = parts.ok_or_else(|| invalid("invalid packet"))?;
            let [number, head, body, before] = numbers(words);
            if head.saturating_add(body) > most {
                return Err(invalid("a message is too long"));
            }
            if before == 0 {
                let message = Message {
                    number,
                    head: Vec::with_capacity(head as usize),
                    body: Vec::with_capacity(body as usize),
                };
                begun = Some((message, 0, head as usize));
            }
            // Another process received the first packet of this message, so the rest is useless.
            let Some((message, there, head)) = begun.as_mut() else {
                continue;
            };
            if message.number != number || *there != before {
                continue;
            }
            let of_head = content.len().min(*head - message.head.len());
            message.head.extend_from_slice(&content[..of_head]);
            message.body.extend_from_slice(&content[of_head..]);
            *there += content.len() as u64;
            let is_whole = *there == *head as u64 + body;
            if is_whole && let Some((message, ..)) = begun.take() {
                return Ok(Some(message));
            }
        }
    }
}

impl AsFd for Channel {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

/// Reads the numbers of a packet head.
fn numbers(words: &[u8; HEAD]) -> [u64; 4] {
    std::array::from_fn(|at| u64::from_le_bytes(std::array::from_fn(|byte| words[8 * at + byte])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_all_sizes_arrive() {
        let (one, other) = Channel::pair().unwrap();
        let large = vec![7; 3 * PACKET + 5];
        let sender = std::thread::spawn(move || {
            one.send(1, &"head", &[b"ab", b"", b"cd"]).unwrap();
            one.send(2, &"", &[]).unwrap();
            one.send(3, &"x".repeat(PACKET), &[&large, b"end"]).unwrap();
        });
        let next = || other.receive(1 << 20).unwrap().unwrap();
        let first = next();
        assert_eq!((first.number, &first.body[..]), (1, &b"abcd"[..]));
        assert_eq!(first.head::<String>().unwrap(), "head");
        assert_eq!(next().number, 2);
        let third = next();
        assert_eq!(third.head::<String>().unwrap().len(), PACKET);
        assert_eq!(third.body.len(), 3 * PACKET + 8);
        sender.join().unwrap();
        assert!(other.receive(1).unwrap().is_none());
    }

    #[test]
    fn unfinished_message_of_killed_sender_is_dropped() {
        let (one, other) = Channel::pair().unwrap();
        let mut packet = Vec::new();
        for word in [1_u64, 2, 100, 0] {
            packet.extend_from_slice(&word.to_le_bytes());
        }
        packet.extend_from_slice(b"\"\"half");
        one.write(&packet).unwrap();
        one.send(2, &"whole", &[b"body"]).unwrap();
        let message = other.receive(1 << 20).unwrap().unwrap();
        assert_eq!((message.number, &message.body[..]), (2, &b"body"[..]));
        assert!(one.send(3, &"", &[&[0; 100]]).is_ok());
        assert!(other.receive(50).is_err(), "longer than the limit");
    }
}
