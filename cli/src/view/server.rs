//! A small HTTP server for one page: it listens on the loopback address alone, answers under a
//! secret path, and gives every connection one answer and little time. It reads no file.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Most connections at a time; others are told to come back.
const MOST: usize = 64;

/// Largest head of a request, bytes.
const HEAD: usize = 8 << 10;

/// How long a request may take to arrive, and an answer to be taken.
const PATIENCE: Duration = Duration::from_secs(5);
const DELIVERY: Duration = Duration::from_secs(60);

/// What is asked for: the path below the secret, and the query.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// Whether something is to change.
    pub posted: bool,
    pub path: String,
    pub query: String,
}

impl Request {
    /// The value of a name in the query.
    pub fn value(&self, name: &str) -> Option<&str> {
        let mut pairs = self.query.split('&').filter_map(|pair| pair.split_once('='));
        pairs.find(|(key, _)| *key == name).map(|(_, value)| value)
    }
}

/// An answer: a status, the kind of what follows, and that.
#[derive(Debug, Clone)]
pub struct Answer {
    pub status: u16,
    pub kind: &'static str,
    pub body: Arc<Vec<u8>>,
}

impl Answer {
    pub fn of(kind: &'static str, body: Vec<u8>) -> Self {
        Self { status: 200, kind, body: Arc::new(body) }
    }

    pub fn refusal(status: u16) -> Self {
        let text = format!("{status} {}\n", reason(status));
        Self { status, kind: "text/plain", body: Arc::new(text.into_bytes()) }
    }
}

/// A server that listens already.
pub struct Server {
    listener: TcpListener,
    secret: String,
}

impl Server {
    /// Listens on a port of the loopback address, or on one that is free.
    pub fn new(port: Option<u16>) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port.unwrap_or(0)))?;
        let mut random = [0_u8; 16];
        getrandom::fill(&mut random).map_err(io::Error::other)?;
        let secret = random.iter().map(|b| format!("{b:02x}")).collect();
        Ok(Self { listener, secret })
    }

    /// The address of the page.
    pub fn address(&self) -> io::Result<String> {
        let port = self.listener.local_addr()?.port();
        Ok(format!("http://127.0.0.1:{port}/{}/", self.secret))
    }

    /// Answers from now on, each connection in a thread of its own.
    pub fn serve(self, answer: impl Fn(&Request) -> Answer + Send + Sync + 'static) {
        let answer = Arc::new(answer);
        let secret: Arc<str> = self.secret.into();
        let open = Arc::new(AtomicUsize::new(0));
        for stream in self.listener.incoming() {
            let Ok(stream) = stream else {
                // Too many files are open, say.
                thread::sleep(Duration::from_millis(20));
                continue;
            };
            if open.fetch_add(1, Ordering::Relaxed) >= MOST {
                open.fetch_sub(1, Ordering::Relaxed);
                let _ = deliver(&stream, &Answer::refusal(503));
                continue;
            }
            let (answer, secret) = (Arc::clone(&answer), Arc::clone(&secret));
            let leave = Leave(Arc::clone(&open));
            let work = move || {
                let _leave = leave;
                let found = match arrived(&stream) {
                    Ok(head) => match understood(&head, &secret) {
                        Ok(request) => answer(&request),
                        Err(status) => Answer::refusal(status),
                    },
                    Err(Some(status)) => Answer::refusal(status),
                    Err(None) => return,
                };
                let _ = deliver(&stream, &found);
            };
            // A thread that cannot be made drops the connection.
            let _ = thread::Builder::new().name("answer".into()).spawn(work);
        }
    }
}

/// Counts a connection out.
struct Leave(Arc<AtomicUsize>);

impl Drop for Leave {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// The head of a request, once all of it is there; else a status to refuse with, or nothing where
/// nobody waits for one.
fn arrived(mut stream: &TcpStream) -> Result<Vec<u8>, Option<u16>> {
    let deadline = Instant::now() + PATIENCE;
    let mut head = Vec::new();
    let mut bytes = [0; 2048];
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(Some(408));
        }
        let _ = stream.set_read_timeout(Some(left));
        match stream.read(&mut bytes) {
            Ok(0) => return Err(None),
            Ok(n) => head.extend_from_slice(&bytes[..n]),
            Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
            Err(e) if matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                return Err(Some(408));
            }
            Err(_) => return Err(None),
        }
        if head.windows(4).any(|w| w == b"\r\n\r\n") {
            return Ok(head);
        }
        if head.len() > HEAD {
            return Err(Some(431));
        }
    }
}

/// What a head asks for, or the status to refuse it with.
fn understood(head: &[u8], secret: &str) -> Result<Request, u16> {
    let mut headers = [httparse::EMPTY_HEADER; 64];
    let mut parsed = httparse::Request::new(&mut headers);
    match parsed.parse(head) {
        Ok(httparse::Status::Complete(_)) => {}
        Ok(httparse::Status::Partial) | Err(_) => return Err(400),
    }
    let (Some(method), Some(target)) = (parsed.method, parsed.path) else { return Err(400) };
    let header = |name: &str| {
        let mut all = parsed.headers.iter().filter(|h| h.name.eq_ignore_ascii_case(name));
        let first = all.next().map(|h| std::str::from_utf8(h.value).unwrap_or_default());
        // Two of one name are a trick.
        if all.next().is_some() { Some("") } else { first }
    };
    // A page of another site may lead its own name here, but cannot say ours.
    let host = header("host").unwrap_or_default();
    if !is_loopback(host) {
        return Err(403);
    }
    let foreign = |origin: &str| origin.strip_prefix("http://") != Some(host);
    if header("origin").is_some_and(foreign)
        || header("sec-fetch-site").is_some_and(|site| site != "same-origin" && site != "none")
    {
        return Err(403);
    }
    let posted = match method {
        "GET" => false,
        // Browsers say from which page a change comes.
        "POST" if header("origin").is_some() => true,
        "POST" => return Err(403),
        _ => return Err(405),
    };
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let below = path.strip_prefix('/').and_then(|path| path.split_once('/'));
    match below {
        Some((own, path)) if own == secret => {
            Ok(Request { posted, path: path.to_owned(), query: query.to_owned() })
        }
        _ => Err(404),
    }
}

/// Whether a host is this machine, on any port: a tunnel may have another.
fn is_loopback(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.parse::<u16>().is_ok() => name,
        Some(_) => return false,
        None => host,
    };
    matches!(name, "127.0.0.1" | "localhost" | "[::1]")
}

fn deliver(mut stream: &TcpStream, answer: &Answer) -> io::Result<()> {
    stream.set_write_timeout(Some(DELIVERY))?;
    let head = format!(
        "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\nX-Frame-Options: DENY\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\n\r\n",
        answer.status,
        reason(answer.status),
        answer.kind,
        answer.body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(&answer.body)?;
    stream.flush()
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        431 => "Request Header Fields Too Large",
        _ => "Service Unavailable",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECRET: &str = "0123";

    fn of(target: &str, headers: &str) -> Result<Request, u16> {
        understood(format!("GET {target} HTTP/1.1\r\n{headers}\r\n").as_bytes(), SECRET)
    }

    #[test]
    fn the_secret_and_this_machine_s_name_are_needed() {
        let host = "Host: 127.0.0.1:80\r\n";
        let found = of("/0123/row?facet=3&at=1,2", host).unwrap();
        assert_eq!((found.path.as_str(), found.value("at")), ("row", Some("1,2")));
        assert_eq!(found.value("a"), None);
        assert_eq!(of("/0123/", "Host: localhost:8017\r\n").unwrap().path, "");
        for wrong in ["/", "/0124/", "/0123", "/012/3/", "/../0123/", "*", "//0123/"] {
            assert_eq!(of(wrong, host), Err(404), "{wrong}");
        }
        for wrong in ["", "Host: example.com\r\n", "Host: 127.0.0.1.example.com\r\n"] {
            assert_eq!(of("/0123/", wrong), Err(403), "{wrong}");
        }
        assert_eq!(of("/0123/", "Host: localhost\r\nHost: localhost\r\n"), Err(403));
    }

    #[test]
    fn other_sites_and_methods_are_refused() {
        let with = |more: &str| of("/0123/", &format!("Host: localhost:1\r\n{more}\r\n"));
        assert!(with("Origin: http://localhost:1").is_ok());
        assert!(with("Sec-Fetch-Site: same-origin").is_ok());
        for wrong in ["Origin: http://localhost:2", "Origin: null", "Sec-Fetch-Site: cross-site"] {
            assert_eq!(with(wrong), Err(403), "{wrong}");
        }
        let by = |method: &str, origin: &str| {
            let head = format!("{method} /0123/ HTTP/1.1\r\nHost: localhost\r\n{origin}\r\n");
            understood(head.as_bytes(), SECRET).map(|r| r.posted)
        };
        assert_eq!(by("POST", ""), Err(403));
        assert_eq!(by("POST", "Origin: http://localhost\r\n"), Ok(true));
        assert_eq!(by("PUT", "Origin: http://localhost\r\n"), Err(405));
        assert_eq!(understood(b"\x16\x03\x01\r\n\r\n", SECRET), Err(400));
    }
}
