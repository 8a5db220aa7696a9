//! A state as bytes.

use super::super::exact::{Number, Row, Whole};
use super::super::replace::replace_file;
use super::super::sums::{Film, Sums};
use super::bits::Writer;
use super::{
    INFINITE, LONGEST_HEAD, MAGIC, MINUS_INFINITE, NOT_A_NUMBER, SPECIAL, StateHead, VERSION, WIDTH,
    checksum, special,
};
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::Path;

/// Rows that are made ready at once: some megabytes.
const ROWS: usize = 64;

/// Writes the sums of a film with what is to be said of them; the same film gives the same bytes. Written aside and renamed.
///
/// # Errors
/// It cannot be written; the old file is as it was.
pub fn write_state(path: &Path, head: &StateHead, film: &Film) -> Result<()> {
    let json = head.to_json().to_string();
    if json.len() > LONGEST_HEAD as usize {
        let reason = format!("its passes are in too many pieces ({}); merge states in order", head.passes);
        return Err(Error::Write { path: path.into(), reason });
    }
    replace_file(path, |file| {
        file.write_all(MAGIC)?;
        file.write_all(&VERSION.to_le_bytes())?;
        block(file, json.as_bytes())?;
        block(file, &colours(&film.sums))?;
        let rows: Vec<usize> = (0..film.height() as usize).collect();
        for rows in rows.chunks(ROWS) {
            let blocks: Vec<Vec<u8>> = rows.par_iter().map(|y| row(&film.sums, *y)).collect();
            blocks.iter().try_for_each(|bytes| block(file, bytes))?;
        }
        Ok(())
    })
}

/// Bytes after their number and before their checksum.
fn block(file: &mut dyn Write, bytes: &[u8]) -> io::Result<()> {
    file.write_all(&(bytes.len() as u32).to_le_bytes())?;
    file.write_all(bytes)?;
    file.write_all(&checksum(bytes).to_le_bytes())
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

/// The lowest exponent and two widths, then each number, bit by bit.
fn numbers<W: Whole>(bytes: &mut Vec<u8>, row: &Row<W>) {
    let all: Vec<Number> = (0..row.len()).map(|i| row.number(i)).collect();
    let exponents = || all.iter().filter_map(exponent);
    let lowest = exponents().min().unwrap_or(0);
    let highest = exponents().max().unwrap_or(0);
    let longest = all.iter().map(length).max().unwrap_or(0);
    // One length more than there is, for what is not finite.
    let widths = [width_of((highest - lowest) as u32), width_of(longest + 1)];
    bytes.extend((lowest as i16).to_le_bytes());
    let mut bits = Writer::new(bytes);
    widths.iter().for_each(|width| bits.put(*width, WIDTH));
    all.iter().for_each(|number| put(&mut bits, number, lowest, widths));
    bits.finish();
}

/// How many bits a number takes.
fn width_of(number: u32) -> u32 {
    u32::BITS - number.leading_zeros()
}

fn exponent(number: &Number) -> Option<i32> {
    match number {
        Number::Finite { exponent, .. } => Some(*exponent),
        _ => None,
    }
}

/// Bits of the magnitude.
fn length(number: &Number) -> u32 {
    match number {
        Number::Finite { magnitude, .. } => {
            8 * magnitude.len() as u32 - magnitude.last().map_or(0, |byte| byte.leading_zeros())
        }
        _ => 0,
    }
}

fn put(bits: &mut Writer<'_>, number: &Number, lowest: i32, [above, lengths]: [u32; 2]) {
    let mut not_finite = |which: u32| {
        bits.put(special(lengths), lengths);
        bits.put(which, SPECIAL);
    };
    match number {
        Number::Zero => bits.put(0, lengths),
        Number::Infinite => not_finite(INFINITE),
        Number::MinusInfinite => not_finite(MINUS_INFINITE),
        Number::Nan => not_finite(NOT_A_NUMBER),
        Number::Finite { negative, exponent, magnitude } => {
            bits.put(length(number), lengths);
            bits.put(u32::from(*negative), 1);
            bits.put((exponent - lowest) as u32, above);
            between_ends(bits, magnitude, length(number));
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
