//! The real program: a broker that watches a directory, and clients that wait for verdicts.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use qcbus_messages::control::{Request, Response};

use crate::Result;
use crate::maps::map;

/// Number of small maps that are judged before the measurement.
const WARM_UP: u64 = 10;

/// Returns the `qcbus` that was built beside the bench.
///
/// # Errors
/// If it does not exist.
pub fn program() -> Result<PathBuf> {
    let own = std::env::current_exe()?;
    let found = own.ancestors().map(|dir| dir.join("qcbus"));
    let mut found = found.filter(|path| path.is_file());
    Ok(found
        .next()
        .ok_or("build it first: cargo build --release -p qcbus")?)
}

/// A warm broker that watches a directory.
pub struct Farm {
    broker: Child,
    /// Watched directory.
    pub watched: PathBuf,
    socket: PathBuf,
    control: BufReader<UnixStream>,
    said: Arc<Mutex<Vec<String>>>,
    _dir: tempfile::TempDir,
}

/// A file that was written and judged.
pub struct Delivered {
    /// Path of the file.
    pub path: PathBuf,
    /// Time at which the file was closed.
    pub closed: Instant,
    /// The same time by the wall clock.
    pub closed_at: SystemTime,
    /// Time at which the verdict arrived.
    pub answered: Instant,
    /// The verdict.
    pub verdict: String,
}

impl Farm {
    /// Starts a broker and lets it judge a few small maps. With `log` it logs the times of its
    /// stages.
    ///
    /// # Errors
    /// If it cannot be started or does not answer.
    pub fn start(program: &Path, log: bool) -> Result<Farm> {
        let dir = tempfile::TempDir::new()?;
        let (watched, instance) = (dir.path().join("in"), dir.path().join("i"));
        std::fs::create_dir(&watched)?;
        let watched = std::fs::canonicalize(watched)?;
        let level = if log {
            "qcbus_broker::stages=debug"
        } else {
            "error"
        };
        let mut broker = Command::new(program)
            .arg("serve")
            .arg(&watched)
            .arg("--instance-dir")
            .arg(&instance)
            .arg("--out")
            .arg(dir.path().join("out"))
            .env("QCBUS_LOG", level)
            .stderr(Stdio::piped())
            .spawn()?;
        let said = Arc::new(Mutex::new(Vec::new()));
        listen(&mut broker, &said);
        let socket = instance.join("control.sock");
        let mut farm = Farm {
            control: connect(&socket)?,
            socket,
            broker,
            watched,
            said,
            _dir: dir,
        };
        for number in 0..WARM_UP {
            let map = map(10_000, number);
            farm.deliver(&format!("warm{number}.xodr"), map.as_bytes())?;
        }
        Ok(farm)
    }

    /// Returns the lines that the broker has logged so far.
    pub fn said(&self) -> std::sync::MutexGuard<'_, Vec<String>> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the time at which the broker logged a stage of a file, in seconds of the day. The
    /// log may be a little behind the verdict.
    ///
    /// # Errors
    /// If the stage is not logged.
    pub fn when(&self, stage: &str, path: &Path) -> Result<f64> {
        let (stage, path) = (format!("stage=\"{stage}\""), path.display().to_string());
        for _ in 0..1000 {
            let said = self.said();
            let line = said
                .iter()
                .find(|line| line.contains(&stage) && line.ends_with(&path));
            if let Some(time) = line.and_then(|line| line.get(11..26)) {
                let parts: Vec<f64> = time.split(':').flat_map(str::parse).collect();
                if let [hours, minutes, seconds] = parts[..] {
                    return Ok(hours * 3600.0 + minutes * 60.0 + seconds);
                }
            }
            drop(said);
            std::thread::sleep(Duration::from_millis(1));
        }
        Err(format!("no {stage} of {path} in the log").into())
    }

    /// Writes one file and waits for its verdict. It pauses before that, because a farm is idle
    /// when a file arrives.
    ///
    /// # Errors
    /// If the file cannot be written or gets no verdict.
    pub fn deliver(&mut self, name: &str, bytes: &[u8]) -> Result<Delivered> {
        let path = self.watched.join(name);
        std::thread::sleep(Duration::from_millis(30));
        let mut file = std::fs::File::create(&path)?;
        file.write_all(bytes)?;
        drop(file);
        let (closed, closed_at) = (Instant::now(), SystemTime::now());
        let verdict = self.wait(&path)?;
        Ok(Delivered {
            path,
            closed,
            closed_at,
            answered: Instant::now(),
            verdict,
        })
    }

    /// Waits for the verdict of a file.
    ///
    /// # Errors
    /// If there is none within a minute.
    pub fn wait(&mut self, file: &Path) -> Result<String> {
        verdict(&ask(&mut self.control, &waiting_for(file))?)
    }

    /// Waits for the verdicts of many files at once, each with its own client.
    ///
    /// # Errors
    /// If a file has no verdict within a minute.
    pub fn wait_for_all(&self, files: &[PathBuf]) -> Result<()> {
        let mut clients = Vec::with_capacity(files.len());
        for file in files {
            let mut client = connect(&self.socket)?;
            say(&mut client, &waiting_for(file))?;
            clients.push(client);
        }
        clients
            .iter_mut()
            .try_for_each(|client| verdict(&hear(client)?).map(|_| ()))
    }

    /// Stops the broker.
    ///
    /// # Errors
    /// If it does not listen any more.
    pub fn stop(mut self) -> Result<()> {
        ask(&mut self.control, &Request::Down)?;
        self.broker.wait()?;
        Ok(())
    }
}

fn listen(broker: &mut Child, said: &Arc<Mutex<Vec<String>>>) {
    let Some(errors) = broker.stderr.take() else {
        return;
    };
    let said = said.clone();
    std::thread::spawn(move || {
        for line in BufReader::new(errors).lines().map_while(|line| line.ok()) {
            said.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(line);
        }
    });
}

fn connect(socket: &Path) -> Result<BufReader<UnixStream>> {
    for _ in 0..5_000 {
        match UnixStream::connect(socket) {
            Ok(stream) => return Ok(BufReader::new(stream)),
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    Err("the broker does not listen".into())
}

fn waiting_for(file: &Path) -> Request {
    Request::Wait {
        file: file.to_path_buf(),
        timeout_ms: Some(60_000),
    }
}

fn verdict(response: &Response) -> Result<String> {
    match response {
        Response::Verdict(verdict) => Ok(verdict.verdict.to_string()),
        other => Err(format!("no verdict: {other:?}").into()),
    }
}

fn ask(control: &mut BufReader<UnixStream>, request: &Request) -> Result<Response> {
    say(control, request)?;
    hear(control)
}

fn say(control: &mut BufReader<UnixStream>, request: &Request) -> Result<()> {
    let mut text = serde_json::to_vec(request)?;
    text.push(b'\n');
    Ok(control.get_mut().write_all(&text)?)
}

fn hear(control: &mut BufReader<UnixStream>) -> Result<Response> {
    let mut line = String::new();
    control.read_line(&mut line)?;
    Ok(serde_json::from_str(&line)?)
}
