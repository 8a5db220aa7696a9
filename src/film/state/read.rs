//! States from files, row by row: the memory of a row.

use super::super::exact::{Number, Row, Whole};
use super::super::peaks::Peaks;
use super::super::sums::Film;
use super::annex::AnnexFile;
use super::bits::Reader;
use super::{
    Common, INFINITE, LONGEST, LONGEST_HEAD, LOWEST, MAGIC, MINUS_INFINITE, NOT_A_NUMBER, SPECIAL, StateHead,
    VERSION, WIDTH, checksum, special,
};
use crate::error::{Error, Result};
use crate::film::Layer;
use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// A state whose head was read.
pub struct StateFile {
    path: PathBuf,
    head: StateHead,
    rest: BufReader<File>,
}

/// What is wrong with a file; its name is added later.
pub(super) type Found<T> = std::result::Result<T, String>;

impl StateFile {
    /// Reads the head and looks whether the file is long enough for what it promises.
    ///
    /// # Errors
    /// One line: the file cannot be read, or is no state, of another version, or damaged.
    pub fn open(path: &Path) -> Result<Self> {
        let refused = |source| Error::Read { path: path.into(), source };
        // Asked before it is opened: a pipe would wait for somebody to write.
        if !std::fs::metadata(path).map_err(refused)?.is_file() {
            return Err(wrong(path, "it is no file".into()));
        }
        let file = File::open(path).map_err(refused)?;
        let there = file.metadata().map_err(refused)?;
        let mut rest = BufReader::with_capacity(1 << 16, file);
        let head = head(&mut rest).map_err(|reason| wrong(path, reason))?;
        // Each number is a bit at least.
        let numbers = 3 * u64::from(head.width) * planes(&head) as u64;
        let annex = head.annex.as_ref().map_or(0, |annex| annex.row.into());
        let least = u64::from(head.height) * (numbers.div_ceil(8) + annex);
        if there.len() < least {
            return Err(wrong(path, CUT.into()));
        }
        Ok(Self { path: path.into(), head, rest })
    }

    /// What it says of itself.
    pub fn head(&self) -> &StateHead {
        &self.head
    }

    /// Adds its sums to a film of the same size and layers. There are no others.
    ///
    /// # Errors
    /// One line: it has an [`Annex`](super::Annex), is damaged, or one of its passes is in the film already. After an error the film is of no use.
    pub fn add_to(mut self, film: &mut Film) -> Result<()> {
        self.must_add_up()?;
        self.add(film).and_then(|()| ended(&mut self.rest)).map_err(|reason| wrong(&self.path, reason))
    }

    /// Refuses sums that are not added to others.
    ///
    /// # Errors
    /// One line: it has an [`Annex`](super::Annex).
    pub fn must_add_up(&self) -> Result<()> {
        let Some(annex) = &self.head.annex else { return Ok(()) };
        let reason = format!("{}; only the render that it is of goes on from it", annex.does_not_add_up());
        Err(Error::Image { path: self.path.clone(), reason })
    }

    /// Adds the sums of its film, and leaves its annex to be read.
    ///
    /// # Errors
    /// One line: it has none, is damaged, or one of its passes is in the film already. After an error the film is of no use.
    pub fn add_to_and_leave(mut self, film: &mut Film) -> Result<AnnexFile> {
        self.add(film).map_err(|reason| wrong(&self.path, reason))?;
        let Self { path, head, rest } = self;
        if head.annex.is_none() {
            return Err(wrong(&path, "it is of a picture alone".into()));
        }
        Ok(AnnexFile::new(path, head, rest))
    }

    fn add(&mut self, film: &mut Film) -> Found<()> {
        let Self { head, rest, .. } = self;
        if (film.width(), film.height()) != (head.width, head.height) || film.layers() != head.layers {
            return Err("its picture is of another size, or has other layers".into());
        }
        let sums = film.joined(&head.passes).map_err(|pass| format!("pass {pass} is in both"))?;
        let mut bytes = Vec::new();
        block(rest, &mut bytes, longest(2, 3))?;
        let mut colours = bytes.as_slice();
        sums.colour.iter_mut().try_for_each(|row| numbers(&mut colours, row))?;
        ends(colours)?;
        let width = head.width as usize;
        let longest = longest(planes(head), 3 * width) + Peaks::longest(width);
        for y in 0..head.height as usize {
            block(rest, &mut bytes, longest)?;
            let mut row = bytes.as_slice();
            sums.layers.iter_mut().try_for_each(|(_, rows)| numbers(&mut row, &mut rows[y]))?;
            numbers(&mut row, &mut sums.squares[y])?;
            sums.bias.iter_mut().try_for_each(|rows| numbers(&mut row, &mut rows[y]))?;
            peaks(row, &mut sums.peaks[y])?;
        }
        Ok(())
    }
}

pub(super) fn ended(rest: &mut impl Read) -> Found<()> {
    match rest.read(&mut [0]) {
        Ok(0) => Ok(()),
        Ok(_) => Err("it goes on after its last row".into()),
        Err(e) => Err(e.to_string()),
    }
}

pub(super) fn wrong(path: &Path, reason: String) -> Error {
    let way_out = "; remove it, or render it again";
    Error::Image { path: path.into(), reason: format!("no state to go on from: {reason}{way_out}") }
}

const CUT: &str = "it ends early";
const DAMAGED: &str = "it is damaged (a checksum does not fit)";

/// Rows of numbers that a row of the picture has.
fn planes(head: &StateHead) -> usize {
    let summed = head.layers.iter().filter(|layer| !matches!(layer, Layer::Error | Layer::Bias));
    summed.count() + 3
}

/// The most bytes of so many rows of so many numbers.
fn longest(rows: usize, numbers: usize) -> usize {
    rows * (6 + numbers * (LONGEST as usize / 8 + 4))
}

fn head(rest: &mut impl Read) -> Found<StateHead> {
    let mut magic = [0; MAGIC.len()];
    if rest.read_exact(&mut magic).is_err() || magic != *MAGIC {
        return Err("halflight did not write it as one".into());
    }
    let version = word(rest)?;
    if version != VERSION {
        return Err(format!("it is of version {version}, and this program reads version {VERSION}"));
    }
    let mut json = Vec::new();
    block(rest, &mut json, LONGEST_HEAD as usize)?;
    let json = serde_json::from_slice(&json).map_err(|_| "its head is no JSON")?;
    StateHead::of_json(&json)
}

fn word(rest: &mut impl Read) -> Found<u32> {
    let mut bytes = [0; 4];
    rest.read_exact(&mut bytes).map_err(|e| cut(&e))?;
    Ok(u32::from_le_bytes(bytes))
}

fn cut(e: &io::Error) -> String {
    if e.kind() == ErrorKind::UnexpectedEof { CUT.into() } else { e.to_string() }
}

/// The next block, in place of what is in `bytes`.
pub(super) fn block(rest: &mut impl Read, bytes: &mut Vec<u8>, longest: usize) -> Found<()> {
    let length = word(rest)? as usize;
    if length > longest {
        return Err(DAMAGED.into());
    }
    bytes.clear();
    // As much as there is, and not what a damaged length promises.
    rest.take(length as u64).read_to_end(bytes).map_err(|e| cut(&e))?;
    if bytes.len() < length {
        return Err(CUT.into());
    }
    let mut sum = [0; 8];
    rest.read_exact(&mut sum).map_err(|e| cut(&e))?;
    if u64::from_le_bytes(sum) == checksum(bytes) { Ok(()) } else { Err(DAMAGED.into()) }
}

pub(super) const MISFIT: &str = "a row does not hold what it should";

/// Takes in the maxima and minima of a row, which end it.
fn peaks(bytes: &[u8], row: &mut Peaks) -> Found<()> {
    let mut bits = Reader::new(bytes);
    row.join_written(&mut bits).ok_or(MISFIT)?;
    ends(bits.finish().ok_or(MISFIT)?)
}

fn ends(rest: &[u8]) -> Found<()> {
    if rest.is_empty() { Ok(()) } else { Err(MISFIT.into()) }
}

/// Adds the numbers of a row.
fn numbers<W: Whole>(bytes: &mut &[u8], row: &mut Row<W>) -> Found<()> {
    let mut bits = Reader::new(bytes);
    let common = Common::take(&mut bits).ok_or(MISFIT)?;
    for i in 0..row.len() {
        let number = number(&mut bits, &common).ok_or(MISFIT)?;
        if !number.is_held() {
            return Err("a number in it is out of reach".into());
        }
        row.add_number(i, &number);
    }
    *bytes = bits.finish().ok_or(MISFIT)?;
    Ok(())
}

impl Common {
    fn take(bits: &mut Reader<'_>) -> Option<Self> {
        let mut lowest = || Some(i32::from(bits.take(LOWEST)? as u16 as i16));
        let (lowest, lowest_top) = (lowest()?, lowest()?);
        let exponents = bits.take(WIDTH)?;
        // Else a number would take no room.
        let tops = bits.take(WIDTH).filter(|tops| *tops > 0)?;
        Some(Self { lowest, lowest_top, exponents, tops, signs: bits.take(1)? })
    }
}

fn number(bits: &mut Reader<'_>, common: &Common) -> Option<Number> {
    let top = bits.take(common.tops)?;
    if top == 0 {
        return Some(Number::Zero);
    }
    if top == special(common.tops) {
        return match bits.take(SPECIAL)? {
            INFINITE => Some(Number::Infinite),
            MINUS_INFINITE => Some(Number::MinusInfinite),
            NOT_A_NUMBER => Some(Number::Nan),
            _ => None,
        };
    }
    let negative = bits.take(common.signs)? == 1;
    let exponent = common.lowest + bits.take(common.exponents)? as i32;
    let length = common.lowest_top + top as i32 - 1 - exponent;
    let magnitude = magnitude(bits, u32::try_from(length).ok().filter(|length| *length > 0)?)?;
    Some(Number::Finite { negative, exponent, magnitude })
}

/// A magnitude of so many bits, the first and the last of which are set. None: too long, or not there.
fn magnitude(bits: &mut Reader<'_>, length: u32) -> Option<Vec<u8>> {
    let mut magnitude = vec![0; (length <= LONGEST).then_some(length.div_ceil(8) as usize)?];
    let mut left = length.saturating_sub(2);
    for (k, byte) in magnitude.iter_mut().enumerate() {
        let (skipped, room) = if k == 0 { (1, 7) } else { (0, 8) };
        let some = left.min(room);
        *byte = (bits.take(some)? << skipped) as u8;
        left -= some;
    }
    magnitude[0] |= 1;
    *magnitude.last_mut()? |= 1 << ((length - 1) % 8);
    Some(magnitude)
}
