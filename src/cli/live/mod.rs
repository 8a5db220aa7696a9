//! A render that is watched: on a page of this machine, in a viewer that listens for pictures.

mod board;
mod http;
mod server;
mod show;
mod tev;

pub use board::{Board, Facts, Goal, Status};

use super::out::say;
use crate::error::{Error, Result};
use crate::film::{Film, Layer, Preview};
use board::{Picture, layers};
use clap::Args;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tev::Tev;

/// Who watches.
#[derive(Args, Clone, Debug)]
pub struct LiveArgs {
    /// Open a page on 127.0.0.1 that shows the picture converge, on a free port or on PORT; its address is printed. The render can be
    /// paused, stopped and told to take more there; at its end the program stays until it is told to quit, or Ctrl-C. Behind SCENE.
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "0", value_parser = port)]
    live: Option<u16>,

    /// Render anew whenever the scene's file changes, or a texture, buffer or environment of it, until Ctrl-C. What cannot be read is
    /// waited for. The camera is the file's; where it has none, that of the render before.
    #[arg(long)]
    pub watch: bool,

    /// Send the picture as it converges to tev, which listens at 127.0.0.1:14158 where it is not told otherwise.
    #[arg(long, value_name = "HOST:PORT", value_parser = host)]
    tev: Option<String>,
}

/// Those who watch a render, and what it tells them.
pub struct Viewers {
    pub board: Arc<Board>,
    page: bool,
    tev: Option<Tev>,
}

/// A page that looked just now gets so long to fetch the last picture.
const GOOD_BYE: Duration = Duration::from_millis(1500);
/// How often a render that waits looks about.
pub const LOOK_ABOUT: Duration = Duration::from_millis(100);

fn port(text: &str) -> std::result::Result<u16, String> {
    text.parse()
        .map_err(|_| format!("`{text}` is no port; write a number below 65536, and the scene before --live"))
}

fn host(text: &str) -> std::result::Result<String, String> {
    let port =
        text.rsplit_once(':').filter(|(host, _)| !host.is_empty()).map(|(_, port)| port.parse::<u16>());
    match port {
        Some(Ok(_)) => Ok(text.into()),
        _ => Err(format!("`{text}` is no HOST:PORT; tev's own is 127.0.0.1:14158")),
    }
}

impl LiveArgs {
    /// Lets them in; `output` is what the picture is called.
    ///
    /// # Errors
    /// The port cannot be had.
    pub fn open(&self, output: &Path) -> Result<Viewers> {
        let board = Arc::<Board>::default();
        if let Some(port) = self.live {
            let address = server::open(port, Arc::clone(&board)).map_err(|why| {
                let port = if port == 0 { String::new() } else { format!(" {port}") };
                Error::Usage(format!(
                    "--live{port}: no page can be opened there: {why}; --live alone takes a free port"
                ))
            })?;
            // Also when quiet: nobody could guess it.
            say(format_args!("live: {address}"));
        }
        let name = output.file_name().unwrap_or(output.as_os_str()).to_string_lossy();
        let tev = self.tev.as_ref().map(|to| {
            Tev::begin(to.clone(), name.into_owned(), Arc::clone(&board))
                .map_err(|why| Error::Usage(format!("--tev {to}: {why}")))
        });
        Ok(Viewers { board, page: self.live.is_some(), tev: tev.transpose()? })
    }
}

impl Viewers {
    /// True where a page is there, so that a render can be told to go on.
    pub fn can_ask(&self) -> bool {
        self.page
    }

    /// Bytes that pictures of this size take for those who watch.
    pub fn bytes(&self, (width, height): (u32, u32), layers: &[Layer]) -> u64 {
        if !self.page && self.tev.is_none() {
            return 0;
        }
        // One that is shown and the next, and what is encoded of one.
        let pixel = 2 * (layers.len() + 1) * size_of::<glam::Vec3>() + 6;
        pixel as u64 * u64::from(width) * u64::from(height)
    }

    /// Shows the picture so far, if it is time to.
    pub fn show(&self, film: &Film, preview: Preview) {
        if self.board.wants_picture() {
            self.show_now(film, preview);
        }
    }

    /// Shows the picture so far, unless it is shown already.
    pub fn show_now(&self, film: &Film, preview: Preview) {
        let (render, shown) = self.board.has(film.passes());
        if shown || film.passes() == 0 || (!self.page && self.tev.is_none()) {
            return;
        }
        let begin = Instant::now();
        self.board.put(Picture::of(render, film, preview), begin.elapsed());
    }

    /// The names of the layers that they can see.
    pub fn layers(film: &Film) -> Vec<&'static str> {
        layers(film).into_iter().map(Layer::name).collect()
    }

    /// The program ends.
    pub fn finish(self) {
        self.board.tell(|facts| facts.status = Status::Ended);
        if self.page && self.board.is_looked_at() {
            std::thread::sleep(GOOD_BYE);
        }
        if let Some(tev) = self.tev {
            tev.finish();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_and_hosts_are_understood_or_refused_with_a_way_out() {
        assert_eq!(port("8080"), Ok(8080));
        assert!(port("scene.glb").is_err_and(|why| why.contains("before --live")));
        assert_eq!(host("::1:14158"), Ok("::1:14158".into()));
        for wrong in ["", "localhost", ":1", "localhost:port", "localhost:70000"] {
            assert!(host(wrong).is_err_and(|why| why.contains("127.0.0.1:14158")), "{wrong}");
        }
    }
}
