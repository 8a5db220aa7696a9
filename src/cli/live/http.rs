//! Requests and answers of HTTP/1.1, one a connection, bounded in size and time.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// What was asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Request {
    pub method: String,
    /// Without the query.
    pub path: String,
    pub query: String,
    pub host: String,
    /// The page that asks, as a browser says.
    pub origin: Option<String>,
}

/// An answer.
pub struct Answer {
    pub status: Status,
    pub kind: &'static str,
    /// Further headers, a line each.
    pub headers: Vec<String>,
    pub body: Vec<u8>,
}

/// A status code and its words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status(pub u16, pub &'static str);

pub const OK: Status = Status(200, "OK");
pub const WRONG: Status = Status(400, "Bad Request");
pub const FORBIDDEN: Status = Status(403, "Forbidden");
pub const NOT_FOUND: Status = Status(404, "Not Found");
pub const NOT_THIS_WAY: Status = Status(405, "Method Not Allowed");
pub const TOO_SLOW: Status = Status(408, "Request Timeout");
pub const NO_BODY: Status = Status(413, "Content Too Large");
pub const TOO_LARGE: Status = Status(431, "Request Header Fields Too Large");
pub const NOT_YET: Status = Status(503, "Service Unavailable");

/// A browser's requests have about 600 bytes and 15 lines.
const MOST_BYTES: usize = 8192;
const MOST_HEADERS: usize = 64;
/// A request on the same machine takes milliseconds.
const PATIENCE: Duration = Duration::from_secs(2);
/// An answer of a few megabytes too.
const MOST_ANSWERING: Duration = Duration::from_secs(20);
/// So much of what nobody wanted to read is read, so that the answer arrives before the connection is reset.
const MOST_DRAINED: usize = 1 << 17;

/// Reads one request.
///
/// # Errors
/// How it is refused. None: whoever asked went away.
pub fn read(stream: &mut TcpStream) -> Result<Request, Option<Status>> {
    let deadline = Instant::now() + PATIENCE;
    let mut head = Vec::new();
    loop {
        let mut more = [0; 1024];
        let count = read_before(stream, &mut more, deadline).map_err(|e| match e.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => Some(TOO_SLOW),
            _ => None,
        })?;
        if count == 0 {
            return Err(None);
        }
        head.extend(&more[..count]);
        match parse(&head) {
            Ok(None) if head.len() >= MOST_BYTES => return Err(Some(TOO_LARGE)),
            Ok(None) => {}
            Ok(Some(request)) => return Ok(request),
            Err(status) => return Err(Some(status)),
        }
    }
}

/// What is there by then; nothing at the end.
fn read_before(stream: &mut TcpStream, buffer: &mut [u8], deadline: Instant) -> io::Result<usize> {
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(buffer) {
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            read => return read,
        }
    }
}

/// None: it goes on.
fn parse(head: &[u8]) -> Result<Option<Request>, Status> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    match parsed.parse(head) {
        Err(httparse::Error::TooManyHeaders) => return Err(TOO_LARGE),
        Err(_) => return Err(WRONG),
        Ok(httparse::Status::Partial) => return Ok(None),
        Ok(httparse::Status::Complete(_)) => {}
    }
    let (path, query) =
        parsed.path.unwrap_or_default().split_once('?').unwrap_or((parsed.path.unwrap_or_default(), ""));
    let all = |name: &str| {
        let named = parsed.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
        named.map(|header| String::from_utf8_lossy(header.value).trim().to_owned()).collect::<Vec<_>>()
    };
    if !all("transfer-encoding").is_empty() || all("content-length").iter().any(|length| length != "0") {
        return Err(NO_BODY);
    }
    let [host] = <[String; 1]>::try_from(all("host")).map_err(|_| WRONG)?;
    Ok(Some(Request {
        method: parsed.method.unwrap_or_default().into(),
        path: path.into(),
        query: query.into(),
        host,
        origin: all("origin").pop(),
    }))
}

impl Answer {
    /// A line of plain text.
    pub fn plain(status: Status, words: &str) -> Self {
        let body = format!("{words}\n").into_bytes();
        Self { status, kind: "text/plain; charset=utf-8", headers: Vec::new(), body }
    }

    /// Sends it and ends the connection. Whoever went away has got what they wanted.
    pub fn send(&self, stream: &mut TcpStream) {
        // Nobody else is told.
        let _ = self.write(stream);
        let _ = stream.shutdown(std::net::Shutdown::Write);
        drain(stream);
    }

    fn write(&self, stream: &mut TcpStream) -> io::Result<()> {
        let Self { status: Status(code, words), kind, headers, body } = self;
        let mut head = format!(
            "HTTP/1.1 {code} {words}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\
             Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
             Cross-Origin-Resource-Policy: same-origin\r\n",
            body.len()
        );
        headers.iter().for_each(|line| head.extend([line, "\r\n"]));
        head.push_str("\r\n");
        let deadline = Instant::now() + MOST_ANSWERING;
        for part in std::iter::once(head.as_bytes()).chain(body.chunks(1 << 16)) {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(ErrorKind::TimedOut.into());
            }
            stream.set_write_timeout(Some(left))?;
            stream.write_all(part)?;
        }
        Ok(())
    }
}

/// Reads what is still coming, up to a bound.
fn drain(stream: &mut TcpStream) {
    let deadline = Instant::now() + PATIENCE;
    let (mut buffer, mut drained) = ([0; 4096], 0);
    while drained < MOST_DRAINED {
        match read_before(stream, &mut buffer, deadline) {
            Ok(0) | Err(_) => return,
            Ok(count) => drained += count,
        }
    }
}

/// The value of a field of a query; what halflight's own page asks needs no escapes but those of a percent sign.
pub fn field<'a>(query: &'a str, name: &str) -> Option<&'a str> {
    query
        .split('&')
        .filter_map(|pair| pair.split_once('='))
        .find(|(known, _)| *known == name)
        .map(|pair| pair.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(text: &str) -> Result<Option<Request>, Status> {
        parse(text.as_bytes())
    }

    #[test]
    fn a_request_is_read_once_all_of_it_is_there() {
        let text = "GET /t/picture?layer=error&exposure=-1.5 HTTP/1.1\r\nhost: 127.0.0.1:80\r\nOrigin: http://a\r\n\r\n";
        for end in 1..text.len() {
            assert_eq!(asked(&text[..end]), Ok(None), "{end}");
        }
        let request = asked(text).unwrap().unwrap();
        assert_eq!((request.method.as_str(), request.path.as_str()), ("GET", "/t/picture"));
        assert_eq!((request.host.as_str(), request.origin.as_deref()), ("127.0.0.1:80", Some("http://a")));
        assert_eq!(
            (field(&request.query, "exposure"), field(&request.query, "layer"), field(&request.query, "e")),
            (Some("-1.5"), Some("error"), None)
        );
    }

    #[test]
    fn what_is_damaged_too_large_or_ambiguous_is_refused() {
        let with = |lines: &str| asked(&format!("GET / HTTP/1.1\r\nHost: a\r\n{lines}\r\n"));
        assert!(with("").is_ok_and(|request| request.is_some()));
        assert_eq!(with("Host: b\r\n"), Err(WRONG));
        assert_eq!(with("Content-Length: 5\r\n"), Err(NO_BODY));
        assert_eq!(with("Transfer-Encoding: chunked\r\n"), Err(NO_BODY));
        assert_eq!(with(&"a: b\r\n".repeat(MOST_HEADERS)), Err(TOO_LARGE));
        assert_eq!(asked("GET / HTTP/1.1\r\n\r\n"), Err(WRONG));
        for damaged in ["\0\0", "GET\r\n\r\n", "GET / HTTP/9.9\r\n\r\n", "\x16\x03\x01 hello"] {
            assert_eq!(asked(damaged), Err(WRONG), "{damaged:?}");
        }
    }
}
