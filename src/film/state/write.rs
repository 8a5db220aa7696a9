//! A state as bytes.

use super::super::exact::{Number, Row, Whole};
use super::super::replace::replace_file;
use super::super::sums::{Film, Sums};
use super::bits::{Writer, width_of};
use super::{
    Annex, Common, INFINITE, LONGEST_HEAD, LOWEST, MAGIC, MINUS_INFINITE, NOT_A_NUMBER, SPECIAL, StateHead,
    VERSION, WIDTH, checksum, special,
};
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::Path;

/// Rows that are made ready at once: some megabytes.
const ROWS: usize = 64;
/// Bytes of an annex that are made ready at once, unless a row alone has more.
const ANNEX_AT_ONCE: usize = 1 << 24;

/// Sums beside a film, as they are to be stored.
pub struct AnnexRows<'a> {
    /// What they are.
    pub name: &'static str,
    /// What is to be known of them before they are read.
    pub facts: Vec<u8>,
    /// Bytes of a row of the picture.
    pub row_bytes: u32,
    /// Those of a row, from the top.
    pub row: &'a (dyn Fn(usize) -> Vec<u8> + Sync),
}

/// Writes the sums of a film with what is to be said of them; the same film gives the same bytes. Written aside and renamed.
///
/// # Errors
/// It cannot be written; the old file is as it was.
pub fn write_state(path: &Path, head: &StateHead, film: &Film) -> Result<()> {
    write(path, &StateHead { annex: None, ..head.clone() }, film, None)
}

/// The same with sums beside the film.
///
/// # Errors
/// It cannot be written; the old file is as it was.
pub fn write_state_with(path: &Path, head: &StateHead, film: &Film, rows: &AnnexRows<'_>) -> Result<()> {
    let annex = Annex { name: rows.name.into(), facts: rows.facts.len() as u32, row: rows.row_bytes };
    write(path, &StateHead { annex: Some(annex), ..head.clone() }, film, Some(rows))
}

fn write(path: &Path, head: &StateHead, film: &Film, annex: Option<&AnnexRows<'_>>) -> Result<()> {
    let json = head.to_json().to_string();
    if json.len() > LONGEST_HEAD as usize {
        let reason = format!("its passes are in too many pieces ({}); merge states in order", head.passes);
        return Err(Error::Write { path: path.into(), reason });
    }
    let height = film.height() as usize;
    replace_file(path, |file| {
        file.write_all(MAGIC)?;
        file.write_all(&VERSION.to_le_bytes())?;
        file.write_all(&block(json.into_bytes()))?;
        file.write_all(&block(colours(&film.sums)))?;
        rows(file, height, ROWS, &|y| row(&film.sums, y))?;
        let Some(annex) = annex else { return Ok(()) };
        file.write_all(&block(annex.facts.clone()))?;
        let at_once = (ANNEX_AT_ONCE / annex.row_bytes as usize).clamp(1, ROWS);
        rows(file, height, at_once, annex.row)
    })
}

/// A block of each row of the picture.
fn rows(
    file: &mut dyn Write,
    height: usize,
    at_once: usize,
    row: &(dyn Fn(usize) -> Vec<u8> + Sync),
) -> io::Result<()> {
    for first in (0..height).step_by(at_once) {
        let some = first..(first + at_once).min(height);
        let blocks: Vec<Vec<u8>> = some.into_par_iter().map(|y| block(row(y))).collect();
        blocks.iter().try_for_each(|block| file.write_all(block))?;
    }
    Ok(())
}

/// Bytes after their number and before their checksum.
fn block(mut bytes: Vec<u8>) -> Vec<u8> {
    let (length, sum) = ((bytes.len() as u32).to_le_bytes(), checksum(&bytes).to_le_bytes());
    bytes.extend(sum);
    bytes.splice(0..0, length);
    bytes
}

fn colours(sums: &Sums) -> Vec<u8> {
    let mut bytes = Vec::new();
    sums.colour.iter().for_each(|row| numbers(&mut bytes, row));
    bytes
}

fn row(sums: &Sums, y: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    sums.layers.iter().for_each(|(_, rows)| numbers(&mut bytes, &rows[y]));
    numbers(&mut bytes, &sums.squares[y]);
    sums.bias.iter().for_each(|rows| numbers(&mut bytes, &rows[y]));
    let mut bits = Writer::new(&mut bytes);
    sums.peaks[y].write(&mut bits);
    bits.finish();
    bytes
}

/// What a row's numbers have in common, then each number, bit by bit.
fn numbers<W: Whole>(bytes: &mut Vec<u8>, row: &Row<W>) {
    let all: Vec<Number> = (0..row.len()).map(|i| row.number(i)).collect();
    let common = Common::of(&all);
    let mut bits = Writer::new(bytes);
    common.put(&mut bits);
    all.iter().for_each(|number| put(&mut bits, number, &common));
    bits.finish();
}

impl Common {
    fn of(all: &[Number]) -> Self {
        let range = |of: fn(&Number) -> Option<i32>| {
            let found = || all.iter().filter_map(of);
            found().min().zip(found().max())
        };
        let (exponents, tops) = (range(exponent), range(top));
        let above = |range: Option<(i32, i32)>| range.map(|(lowest, highest)| (highest - lowest) as u32);
        Self {
            lowest: exponents.map_or(0, |(lowest, _)| lowest),
            lowest_top: tops.map_or(0, |(lowest, _)| lowest),
            exponents: width_of(above(exponents).unwrap_or(0)),
            // Zero is before all tops, and what is not finite behind them.
            tops: width_of(above(tops).map_or(1, |above| above + 2)),
            signs: u32::from(
                all.iter().any(|number| matches!(number, Number::Finite { negative: true, .. })),
            ),
        }
    }

    fn put(&self, bits: &mut Writer<'_>) {
        [self.lowest, self.lowest_top].iter().for_each(|x| bits.put(u32::from(*x as i16 as u16), LOWEST));
        [self.exponents, self.tops].iter().for_each(|width| bits.put(*width, WIDTH));
        bits.put(self.signs, 1);
    }
}

fn exponent(number: &Number) -> Option<i32> {
    match number {
        Number::Finite { exponent, .. } => Some(*exponent),
        _ => None,
    }
}

/// The exponent behind the last bit of the magnitude.
fn top(number: &Number) -> Option<i32> {
    match number {
        Number::Finite { exponent, magnitude, .. } => Some(exponent + length(magnitude) as i32),
        _ => None,
    }
}

/// Bits of a magnitude.
fn length(magnitude: &[u8]) -> u32 {
    8 * magnitude.len() as u32 - magnitude.last().map_or(0, |byte| byte.leading_zeros())
}

fn put(bits: &mut Writer<'_>, number: &Number, common: &Common) {
    let mut not_finite = |which: u32| {
        bits.put(special(common.tops), common.tops);
        bits.put(which, SPECIAL);
    };
    match number {
        Number::Zero => bits.put(0, common.tops),
        Number::Infinite => not_finite(INFINITE),
        Number::MinusInfinite => not_finite(MINUS_INFINITE),
        Number::Nan => not_finite(NOT_A_NUMBER),
        Number::Finite { negative, exponent, magnitude } => {
            let length = length(magnitude);
            bits.put((exponent + length as i32 - common.lowest_top + 1) as u32, common.tops);
            bits.put(u32::from(*negative), common.signs);
            bits.put((exponent - common.lowest) as u32, common.exponents);
            between_ends(bits, magnitude, length);
        }
    }
}

/// The bits of a magnitude between its first and its last, which are set.
fn between_ends(bits: &mut Writer<'_>, magnitude: &[u8], length: u32) {
    let mut left = length.saturating_sub(2);
    for (k, byte) in magnitude.iter().enumerate() {
        let (byte, room) = if k == 0 { (byte >> 1, 7) } else { (*byte, 8) };
        let some = left.min(room);
        bits.put(u32::from(byte) & ((1 << some) - 1), some);
        left -= some;
    }
}
