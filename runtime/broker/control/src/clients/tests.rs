use std::path::PathBuf;

use tokio::sync::mpsc::UnboundedReceiver;

use super::*;

/// A socket with a broker that answers `status` and delays every client that waits for a verdict.
struct Socket {
    dir: tempfile::TempDir,
    clients: Arc<Clients>,
    asked: UnboundedReceiver<Asked>,
    kept: Vec<Asked>,
}

const SHORT: Duration = Duration::from_millis(100);

impl Socket {
    fn new(bounds: Bounds) -> Socket {
        let dir = tempfile::tempdir().unwrap();
        let listener = UnixListener::bind(dir.path().join("socket")).unwrap();
        let (inbox, asked) = mpsc::unbounded_channel();
        let clients = Clients::new(bounds, inbox);
        tokio::spawn(clients.clone().accept(listener));
        Socket {
            dir,
            clients,
            asked,
            kept: Vec::new(),
        }
    }

    fn path(&self) -> PathBuf {
        self.dir.path().join("socket")
    }

    async fn connect(&self, said: &str) -> UnixStream {
        let mut stream = UnixStream::connect(self.path()).await.unwrap();
        let _ = stream.write_all(said.as_bytes()).await;
        stream
    }

    /// Returns the received text up to the end of a line or of the stream.
    async fn hear(&mut self, stream: &mut UnixStream) -> String {
        let mut line = Vec::new();
        let mut reader = BufReader::new(stream);
        let reading = reader.read_until(b'\n', &mut line);
        tokio::pin!(reading);
        let watchdog = tokio::time::sleep(Duration::from_secs(60));
        tokio::pin!(watchdog);
        loop {
            tokio::select! {
                read = &mut reading => { let _ = read; break }
                Some(asked) = self.asked.recv() => match asked.request {
                    Request::Wait { .. } => self.kept.push(asked),
                    _ => {
                        let _ = asked.answer.send(Response::TimedOut);
                    }
                },
                () = &mut watchdog => panic!("watchdog timeout: no answer"),
            }
        }
        String::from_utf8(line).unwrap()
    }

    async fn until_kept(&mut self, count: usize) {
        while self.kept.len() < count {
            let asked = timeout(Duration::from_secs(60), self.asked.recv()).await;
            self.kept.push(asked.expect("watchdog timeout").unwrap());
        }
    }
}

fn bounds(clients: usize, waiting: usize) -> Bounds {
    Bounds {
        clients,
        waiting,
        request_within: Duration::from_secs(3600),
        answer_within: Duration::from_secs(3600),
    }
}

const STATUS: &str = "{\"request\":\"status\"}\n";
const WAIT: &str = "{\"request\":\"wait\",\"file\":\"/x.xodr\",\"timeout_ms\":null}\n";

#[tokio::test]
async fn request_length_is_bounded_but_request_count_is_not() {
    let mut socket = Socket::new(bounds(8, 4));
    let mut client = socket.connect("").await;
    let padded = format!("{}{STATUS}", " ".repeat(MAX_REQUEST - STATUS.len()));
    for _ in 0..5 {
        client.write_all(padded.as_bytes()).await.unwrap();
        assert!(socket.hear(&mut client).await.contains("timed-out"));
    }
    let mut client = socket.connect(&" ".repeat(MAX_REQUEST + 1)).await;
    let said = socket.hear(&mut client).await;
    assert!(said.contains("at most 65536 bytes"), "{said}");
    assert_eq!(
        socket.hear(&mut client).await,
        "",
        "the connection is closed"
    );
    let mut client = socket.connect("what?\n").await;
    let said = socket.hear(&mut client).await;
    assert!(said.contains("invalid request"), "{said}");
    // `echo … | nc -U` does the same.
    let mut client = socket.connect(STATUS.trim()).await;
    client.shutdown().await.unwrap();
    assert!(socket.hear(&mut client).await.contains("timed-out"));
}

#[tokio::test]
async fn silent_or_incomplete_client_is_disconnected() {
    let mut socket = Socket::new(Bounds {
        request_within: SHORT,
        ..bounds(8, 4)
    });
    for said in ["", "{\"request\"", "{\"request\":\"status\"}"] {
        let mut client = socket.connect(said).await;
        let heard = socket.hear(&mut client).await;
        assert!(heard.contains("no request was received"), "{said}: {heard}");
        assert_eq!(
            socket.hear(&mut client).await,
            "",
            "the connection is closed"
        );
    }
    // A client that was answered may not stay either.
    let mut client = socket.connect(STATUS).await;
    assert!(socket.hear(&mut client).await.contains("timed-out"));
    assert!(
        socket
            .hear(&mut client)
            .await
            .contains("no request was received")
    );
}

#[tokio::test]
async fn client_that_does_not_read_is_disconnected() {
    let mut socket = Socket::new(Bounds {
        answer_within: SHORT,
        ..bounds(8, 4)
    });
    let _client = socket.connect(STATUS).await;
    let asked = timeout(Duration::from_secs(60), socket.asked.recv()).await;
    let reason = "long ".repeat(1 << 20);
    let answered = asked
        .unwrap()
        .unwrap()
        .answer
        .send(Response::Failed { reason });
    answered.unwrap();
    while !socket.clients.there().is_empty() {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn silent_clients_make_room_and_waiting_ones_stay() {
    let mut socket = Socket::new(bounds(8, 4));
    let mut waiting = Vec::new();
    for count in 1..=4 {
        waiting.push(socket.connect(WAIT).await);
        socket.until_kept(count).await;
    }
    let mut refused = socket.connect(WAIT).await;
    let said = socket.hear(&mut refused).await;
    assert!(
        said.contains("4 clients already wait for verdicts"),
        "{said}"
    );
    let mut silent = Vec::new();
    for _ in 0..40 {
        silent.push(socket.connect("").await);
        let mut honest = socket.connect(STATUS).await;
        assert!(socket.hear(&mut honest).await.contains("timed-out"));
    }
    let said = socket.hear(&mut silent[0]).await;
    assert!(
        said.contains("disconnects silent ones to make room"),
        "{said}"
    );
    for asked in std::mem::take(&mut socket.kept) {
        asked.answer.send(Response::Stopped).unwrap();
    }
    for mut client in waiting {
        assert!(socket.hear(&mut client).await.contains("stopped"));
    }
}

#[tokio::test]
async fn state_of_disconnected_client_is_released() {
    let mut socket = Socket::new(bounds(8, 4));
    let waiting = socket.connect(WAIT).await;
    // This client sends no further request, but it still waits.
    let mut patient = socket.connect(WAIT).await;
    patient.shutdown().await.unwrap();
    socket.until_kept(2).await;
    drop(waiting);
    let closed = |asked: &&mut Asked| asked.answer.is_closed();
    while socket.kept.iter_mut().filter(closed).count() == 0 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    // The next probe would also have found the other client, if it had left.
    tokio::time::sleep(LOOK + SHORT).await;
    assert_eq!(socket.kept.iter_mut().filter(closed).count(), 1);
    socket.kept.retain(|it| !it.answer.is_closed());
    let asked = socket.kept.pop().unwrap();
    asked.answer.send(Response::Stopped).unwrap();
    assert!(socket.hear(&mut patient).await.contains("stopped"));
    drop(patient);
    while !socket.clients.there().is_empty() {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

#[tokio::test]
async fn client_is_refused_when_all_are_busy() {
    let mut socket = Socket::new(bounds(2, 2));
    let _waiting = [socket.connect(WAIT).await, socket.connect(WAIT).await];
    socket.until_kept(2).await;
    let mut refused = socket.connect(STATUS).await;
    let said = socket.hear(&mut refused).await;
    assert!(said.contains("already serves 2 clients"), "{said}");
}
