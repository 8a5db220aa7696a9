//! Sends pictures to tev as it describes its protocol: packets of a length, a kind and fields, integers in little endian, strings
//! that end with a zero.

use super::board::{Board, Picture};
use crate::cli::out::say;
use crate::film::Layer;
use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A viewer that is sent pictures until the program ends.
pub struct Tev {
    thread: JoinHandle<()>,
    /// No further picture comes.
    last: Arc<AtomicBool>,
}

/// Packets stay below the megabyte for which tev has room without making more.
const MOST_PACKET: usize = 1 << 19;
/// A viewer that takes longer than this to answer or to read is away.
const PATIENCE: Duration = Duration::from_secs(3);
/// How often one that is away is looked for.
const AGAIN: Duration = Duration::from_secs(2);
const CREATE_IMAGE: u8 = 4;
/// The one with channels, offsets and strides.
const UPDATE_IMAGE: u8 = 6;

impl Tev {
    /// Sends to HOST:PORT what the board shows, as a picture of that name.
    ///
    /// # Errors
    /// No thread can be had.
    pub fn begin(to: String, name: String, board: Arc<Board>) -> io::Result<Self> {
        let last = Arc::new(AtomicBool::new(false));
        let mut sender = Sender { to, name, board, last: Arc::clone(&last), trouble: None, met: false };
        let thread = std::thread::Builder::new().name("tev".into()).spawn(move || sender.run())?;
        Ok(Self { thread, last })
    }

    /// Waits until the last picture is sent, or cannot be.
    pub fn finish(self) {
        self.last.store(true, Ordering::Release);
        // It has told what went wrong.
        let _ = self.thread.join();
    }
}

struct Sender {
    to: String,
    name: String,
    board: Arc<Board>,
    last: Arc<AtomicBool>,
    /// What was said last of a viewer that is away.
    trouble: Option<&'static str>,
    /// True from when one was there.
    met: bool,
}

impl Sender {
    fn run(&mut self) {
        loop {
            match self.connect() {
                Ok(mut stream) => {
                    let Err(e) = self.send_all(&mut stream) else { return };
                    self.away(&e);
                }
                Err(e) => self.away(&e),
            }
            let due = Instant::now() + AGAIN;
            while Instant::now() < due {
                if self.is_last() {
                    return;
                }
                std::thread::sleep(Duration::from_millis(50));
            }
        }
    }

    fn connect(&self) -> io::Result<TcpStream> {
        let mut error = io::Error::other("no such host");
        for address in self.to.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(PATIENCE))?;
                    stream.set_nodelay(true)?;
                    return Ok(stream);
                }
                Err(e) => error = e,
            }
        }
        Err(error)
    }

    /// Until the last picture is sent.
    fn send_all(&mut self, stream: &mut TcpStream) -> io::Result<()> {
        self.met = true;
        if self.trouble.take().is_some() {
            say(format_args!("--tev {}: the viewer is there", self.to));
        }
        let (mut shape, mut sent) = (None, None);
        loop {
            self.board.look();
            // Asked before the picture is: what is put up before the end is sent.
            let last = self.is_last();
            if let Some(picture) = self.board.next_picture(sent, Duration::from_millis(100)) {
                let channels = channels(&picture);
                let of = (picture.of.0, picture.width, picture.height, channels.len());
                if shape.replace(of) != Some(of) {
                    stream.write_all(&create(&self.name, &picture, &channels))?;
                }
                tiles(&self.name, &picture, &channels).try_for_each(|packet| stream.write_all(&packet))?;
                sent = Some(picture.of);
            } else if last {
                return Ok(());
            }
        }
    }

    fn is_last(&self) -> bool {
        self.last.load(Ordering::Acquire)
    }

    /// Says so once.
    fn away(&mut self, why: &io::Error) {
        let trouble = if self.met { "the viewer went away" } else { "no viewer is there" };
        if self.trouble.replace(trouble) != Some(trouble) {
            say(format_args!(
                "--tev {}: {trouble} ({why}); the render goes on, and it is looked for again",
                self.to
            ));
        }
    }
}

/// A channel: the name that files give it, the plane that it is of, and the component.
struct Channel {
    name: String,
    layer: Layer,
    component: usize,
}

fn channels(picture: &Picture) -> Vec<Channel> {
    let of = |layer: Layer| {
        let name = move |component: &str| match layer {
            Layer::Visible => component.to_owned(),
            _ => format!("{layer}.{component}"),
        };
        let names = layer.components().iter().map(move |component| name(component));
        names.enumerate().map(move |(component, name)| Channel { name, layer, component })
    };
    picture.planes.iter().flat_map(|(layer, _)| of(*layer)).collect()
}

/// A packet as it is put together.
struct Packet(Vec<u8>);

impl Packet {
    /// Of a kind, about a picture of a name; it does not push itself before others.
    fn new(kind: u8, name: &str) -> Self {
        Self(vec![0, 0, 0, 0, kind, 0]).string(name)
    }

    fn string(mut self, text: &str) -> Self {
        self.0.extend(text.bytes().filter(|byte| *byte != 0));
        self.0.push(0);
        self
    }

    fn numbers(mut self, numbers: impl IntoIterator<Item = u32>) -> Self {
        self.0.extend(numbers.into_iter().flat_map(u32::to_le_bytes));
        self
    }

    fn long_numbers(mut self, numbers: impl IntoIterator<Item = usize>) -> Self {
        self.0.extend(numbers.into_iter().flat_map(|number| (number as u64).to_le_bytes()));
        self
    }

    fn names(self, channels: &[Channel]) -> Self {
        channels.iter().fold(self, |packet, channel| packet.string(&channel.name))
    }

    /// With its length in front.
    fn done(mut self) -> Vec<u8> {
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}

fn create(name: &str, picture: &Picture, channels: &[Channel]) -> Vec<u8> {
    let numbers = [picture.width, picture.height, channels.len() as u32];
    Packet::new(CREATE_IMAGE, name).numbers(numbers).names(channels).done()
}

/// All pixels, in bands of rows or, of rows that are very long, in parts of one; channels of a pixel stand side by side.
fn tiles<'a>(
    name: &'a str,
    picture: &'a Picture,
    channels: &'a [Channel],
) -> impl Iterator<Item = Vec<u8>> + 'a {
    let most = (MOST_PACKET / (4 * channels.len())).max(1) as u32;
    let (width, height) = (most.min(picture.width), (most / picture.width).clamp(1, picture.height));
    let corners = (0..picture.height)
        .step_by(height as usize)
        .flat_map(move |y| (0..picture.width).step_by(width as usize).map(move |x| (x, y)));
    corners.map(move |(x, y)| {
        let size = (width.min(picture.width - x), height.min(picture.height - y));
        tile(name, picture, channels, (x, y), size)
    })
}

fn tile(
    name: &str,
    picture: &Picture,
    channels: &[Channel],
    (x, y): (u32, u32),
    (width, height): (u32, u32),
) -> Vec<u8> {
    let planes: Vec<_> = channels
        .iter()
        .map(|channel| (picture.plane(channel.layer).expect("a plane of its own"), channel.component))
        .collect();
    let mut packet = Packet::new(UPDATE_IMAGE, name)
        .numbers([channels.len() as u32])
        .names(channels)
        .numbers([x, y, width, height])
        .long_numbers(0..channels.len())
        .long_numbers(channels.iter().map(|_| channels.len()));
    for row in y..y + height {
        let first = row as usize * picture.width as usize + x as usize;
        for pixel in first..first + width as usize {
            packet
                .0
                .extend(planes.iter().flat_map(|(plane, component)| plane[pixel][*component].to_le_bytes()));
        }
    }
    packet.done()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Preview;
    use glam::Vec3;

    fn picture(width: u32, height: u32, layers: &[Layer]) -> Picture {
        let pixels = (width * height) as usize;
        let plane = |k: usize| (0..pixels).map(|i| Vec3::new(i as f32, k as f32, -1.0)).collect();
        let planes = layers.iter().enumerate().map(|(k, layer)| (*layer, plane(k))).collect();
        Picture { of: (1, 1), width, height, planes, preview: Preview::default() }
    }

    /// By hand, from the description.
    #[test]
    fn packets_are_what_the_protocol_says() {
        let picture = picture(2, 1, &[Layer::Depth]);
        let channels = channels(&picture);
        let expected = [
            &32_u32.to_le_bytes()[..],
            &[4, 0],
            b"a.exr\0",
            &[2, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0],
            b"depth.Z\0",
        ];
        assert_eq!(create("a.exr", &picture, &channels), expected.concat());
        let packets: Vec<_> = tiles("a", &picture, &channels).collect();
        let expected = [
            &60_u32.to_le_bytes()[..],
            &[6, 0],
            b"a\0",
            &[1, 0, 0, 0],
            b"depth.Z\0",
            &[0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0],
            &[0; 8],
            &[1, 0, 0, 0, 0, 0, 0, 0],
            &0.0_f32.to_le_bytes(),
            &1.0_f32.to_le_bytes(),
        ];
        assert_eq!(packets, [expected.concat()]);
    }

    #[test]
    fn tiles_cover_every_pixel_once_in_small_packets() {
        for (width, height) in [(700, 300), (1, 5), (200_000, 2)] {
            let picture = picture(width, height, &[Layer::Visible, Layer::Error]);
            let channels = channels(&picture);
            let names: Vec<_> = channels.iter().map(|channel| channel.name.as_str()).collect();
            assert_eq!(names, ["R", "G", "B", "error.R", "error.G", "error.B"]);
            let mut pixels = 0;
            for packet in tiles("name", &picture, &channels) {
                assert!(packet.len() < MOST_PACKET + 200);
                let at = 6 + 5 + 4 + names.iter().map(|name| name.len() + 1).sum::<usize>();
                let number = |i: usize| u32::from_le_bytes(packet[at + 4 * i..][..4].try_into().unwrap());
                let data = &packet[at + 16 + 2 * 8 * channels.len()..];
                assert_eq!(data.len() as u32, number(2) * number(3) * 24);
                assert_eq!(
                    f32::from_le_bytes(data[..4].try_into().unwrap()),
                    (number(1) * width + number(0)) as f32
                );
                pixels += number(2) * number(3);
            }
            assert_eq!(pixels, width * height);
        }
    }
}
