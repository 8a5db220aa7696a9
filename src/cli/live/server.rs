//! The page on 127.0.0.1: who is let in, and what they get. Nothing of the machine is served but one render.

use super::board::{Board, Goal};
use super::http::{
    self, Answer, FORBIDDEN, NOT_FOUND, NOT_THIS_WAY, NOT_YET, OK, Request, Status, WRONG, field,
};
use super::show::{Encoder, Wanted};
use crate::cli::limits::positive;
use crate::report::fill;
use std::fmt::Write;
use std::io;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// A page for those who know its address.
struct Page {
    port: u16,
    token: String,
    board: Arc<Board>,
    encoder: Encoder,
    /// Connections under way.
    open: AtomicUsize,
}

/// A browser opens six at most.
const MOST_CONNECTIONS: usize = 16;
/// How long to wait where no connection can be accepted, as where no file can be opened.
const NO_CONNECTION: Duration = Duration::from_millis(50);
/// Whoever takes more passes than this from a page has mistyped.
const MOST_PASSES: u32 = 1_000_000;

/// Opens the page on a port, any free one for 0, and answers until the program ends. Returns its address.
///
/// # Errors
/// The port cannot be had, or the system has no random numbers.
pub fn open(port: u16, board: Arc<Board>) -> io::Result<String> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    let port = listener.local_addr()?.port();
    let page = Arc::new(Page { port, token: random()?, board, encoder: Encoder::default(), open: 0.into() });
    let address = format!("http://127.0.0.1:{port}/{}/", page.token);
    std::thread::Builder::new().name("live page".into()).spawn(move || accept(&listener, &page))?;
    Ok(address)
}

/// 128 bits that nobody can guess.
fn random() -> io::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(io::Error::other)?;
    Ok(bytes.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("a string takes what is written");
        text
    }))
}

fn accept(listener: &TcpListener, page: &Arc<Page>) {
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            std::thread::sleep(NO_CONNECTION);
            continue;
        };
        if page.open.fetch_add(1, Ordering::AcqRel) >= MOST_CONNECTIONS {
            // Closed without a word: whoever holds the others would hold this one too.
            page.open.fetch_sub(1, Ordering::AcqRel);
            continue;
        }
        let own = Arc::clone(page);
        let answering = std::thread::Builder::new().name("live answer".into()).spawn(move || {
            own.answer(stream);
            own.open.fetch_sub(1, Ordering::AcqRel);
        });
        if answering.is_err() {
            page.open.fetch_sub(1, Ordering::AcqRel);
        }
    }
}

impl Page {
    fn answer(&self, mut stream: TcpStream) {
        let answer = match http::read(&mut stream) {
            Ok(request) => self.of(&request).unwrap_or_else(refusal),
            Err(Some(status)) => refusal(status),
            Err(None) => return,
        };
        answer.send(&mut stream);
    }

    fn of(&self, request: &Request) -> Result<Answer, Status> {
        self.admit(request)?;
        let asked = self.asked(&request.path).ok_or(NOT_FOUND)?;
        self.board.look();
        match (request.method.as_str(), asked) {
            ("GET", "") => self.page().map_err(|_| NOT_YET),
            ("GET", "state") => Ok(self.state()),
            ("GET", "picture") => self.picture(&request.query),
            ("POST", wish) => self.wish(wish, &request.query),
            ("GET", "pause" | "go" | "stop" | "quit" | "more") => Err(NOT_THIS_WAY),
            ("GET", _) => Err(NOT_FOUND),
            _ => Err(NOT_THIS_WAY),
        }
    }

    /// A page of another site, whose name was made to lead here, says its own name; one that reaches over says where it is from.
    fn admit(&self, request: &Request) -> Result<(), Status> {
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let ours = hosts.contains(&request.host);
        let origin =
            request.origin.as_ref().is_none_or(|origin| *origin == format!("http://{}", request.host));
        if ours && origin { Ok(()) } else { Err(FORBIDDEN) }
    }

    /// What is asked for behind the token. None: the token is wrong.
    fn asked<'a>(&self, path: &'a str) -> Option<&'a str> {
        let path = path.strip_prefix('/')?;
        let (token, asked) = path.split_once('/').unwrap_or((path, ""));
        same(token.as_bytes(), self.token.as_bytes()).then_some(asked)
    }

    fn page(&self) -> io::Result<Answer> {
        let nonce = random()?;
        let values = [
            ("nonce", nonce.as_str()),
            ("style", include_str!("page.css")),
            ("script", include_str!("page.js")),
        ];
        let policy = format!(
            "Content-Security-Policy: default-src 'none'; img-src blob: data:; connect-src 'self'; style-src 'nonce-{nonce}'; \
             script-src 'nonce-{nonce}'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        );
        Ok(Answer {
            status: OK,
            kind: "text/html; charset=utf-8",
            headers: vec![policy, "X-Frame-Options: DENY".into()],
            body: fill(include_str!("page.html"), &values).into_bytes(),
        })
    }

    fn state(&self) -> Answer {
        let picture = self.board.picture().map(|picture| picture.of);
        let state = serde_json::json!({
            "facts": self.board.facts(),
            "picture": picture,
            "pause": self.board.is_paused(),
            "stop": self.board.is_stopped(),
        });
        Answer {
            status: OK,
            kind: "application/json",
            headers: Vec::new(),
            body: state.to_string().into_bytes(),
        }
    }

    fn picture(&self, query: &str) -> Result<Answer, Status> {
        let picture = self.board.picture().ok_or(NOT_YET)?;
        let wanted = Wanted::read(query, picture.preview).ok_or(WRONG)?;
        let encoded = self.encoder.encode(&picture, wanted).ok_or(NOT_FOUND)?;
        let (render, passes) = encoded.of;
        let headers =
            vec![format!("X-Picture: {render} {passes}"), format!("X-Exposure: {:.2}", encoded.stops)];
        Ok(Answer { status: OK, kind: "image/png", headers, body: encoded.png.clone() })
    }

    fn wish(&self, wish: &str, query: &str) -> Result<Answer, Status> {
        match wish {
            "pause" => self.board.pause(true),
            "go" => self.board.pause(false),
            "stop" => self.board.stop(),
            "quit" => self.board.quit(),
            "more" => self.board.more(goal(query, self.board.facts().takes_passes).ok_or(WRONG)?),
            _ => return Err(NOT_FOUND),
        }
        Ok(self.state())
    }
}

/// None: it says none, or none that can be followed.
fn goal(query: &str, takes_passes: bool) -> Option<Goal> {
    match (field(query, "passes"), field(query, "error")) {
        (Some(passes), None) if takes_passes => {
            let passes = passes.parse().ok().filter(|passes| (1..=MOST_PASSES).contains(passes));
            passes.map(Goal::Passes)
        }
        (None, Some(error)) if takes_passes => positive(error).ok().map(Goal::Error),
        _ => None,
    }
}

fn refusal(status: Status) -> Answer {
    Answer::plain(status, status.1)
}

/// In a time that does not tell how many bytes agree.
fn same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |off, (a, b)| off | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page() -> Page {
        let token = random().unwrap();
        Page { port: 8080, token, board: Arc::default(), encoder: Encoder::default(), open: 0.into() }
    }

    fn asked(page: &Page, method: &str, asked: &str) -> Request {
        let (path, query) = asked.split_once('?').unwrap_or((asked, ""));
        let path = format!("/{}/{path}", page.token);
        Request {
            method: method.into(),
            path,
            query: query.into(),
            host: "127.0.0.1:8080".into(),
            origin: None,
        }
    }

    fn status(page: &Page, request: &Request) -> u16 {
        match page.of(request) {
            Ok(answer) => answer.status.0,
            Err(Status(code, _)) => code,
        }
    }

    #[test]
    fn only_its_own_address_is_let_in() {
        let page = page();
        let good = asked(&page, "GET", "state");
        assert_eq!(status(&page, &good), 200);
        assert_eq!(status(&page, &Request { host: "localhost:8080".into(), ..good.clone() }), 200);
        for host in
            ["", "evil.example", "evil.example:8080", "127.0.0.1", "127.0.0.1:80", "127.0.0.1:8080.evil"]
        {
            assert_eq!(status(&page, &Request { host: host.into(), ..good.clone() }), 403, "{host}");
        }
        let from = |origin: &str| Request { origin: Some(origin.into()), ..good.clone() };
        assert_eq!(status(&page, &from("http://127.0.0.1:8080")), 200);
        for origin in ["null", "https://evil.example", "http://127.0.0.1:9090"] {
            assert_eq!(status(&page, &from(origin)), 403, "{origin}");
        }
        for path in ["/", "/state", "//state", "/0123456789abcdef0123456789abcdef/state", "/../etc/passwd"] {
            assert_eq!(status(&page, &Request { path: path.into(), ..good.clone() }), 404, "{path}");
        }
    }

    #[test]
    fn wishes_are_posted_and_reach_the_render() {
        let page = page();
        let post = |wish: &str| status(&page, &asked(&page, "POST", wish));
        page.board.tell(|facts| facts.takes_passes = true);
        for wish in ["pause", "go", "stop", "quit", "more?passes=1"] {
            assert_eq!(status(&page, &asked(&page, "GET", wish)), 405, "{wish}");
        }
        assert_eq!((post("pause"), page.board.is_paused()), (200, true));
        assert_eq!((post("go"), page.board.is_paused()), (200, false));
        for wrong in
            ["more", "more?passes=0", "more?passes=-1", "more?passes=9e9", "more?error=0", "more?error=nan"]
        {
            assert_eq!((post(wrong), page.board.take_more()), (400, None), "{wrong}");
        }
        assert_eq!((post("stop"), page.board.is_stopped()), (200, true));
        assert_eq!((post("more?passes=7"), page.board.take_more()), (200, Some(Goal::Passes(7))));
        assert!(!page.board.is_stopped());
        assert_eq!((post("more?error=0.5"), page.board.take_more()), (200, Some(Goal::Error(0.5))));
        assert_eq!((post("quit"), page.board.is_quit()), (200, true));
        assert_eq!((post("picture"), post("")), (404, 404));
        // Passes that were dealt out are no one's to take.
        page.board.tell(|facts| facts.takes_passes = false);
        assert_eq!((post("more?passes=7"), page.board.take_more()), (400, None));
        assert_eq!(status(&page, &asked(&page, "GET", "picture")), 503);
    }

    #[test]
    fn tokens_are_long_and_differ() {
        let (a, b) = (random().unwrap(), random().unwrap());
        assert!(a.len() == 32 && a != b && a.bytes().all(|byte| byte.is_ascii_hexdigit()));
        assert!(same(b"abc", b"abc") && !same(b"abc", b"abd") && !same(b"ab", b"abc"));
    }
}
