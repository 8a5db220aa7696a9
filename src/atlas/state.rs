//! The sums of an atlas in the state of a render, beside its film: docs/state-format.md.
//!
//! They are single-precision numbers that were added in the order of passes, so that they are stored as they are, and only what comes
//! next is added to them.

use super::errors::ColourSpread;
use super::frontier::{Frontier, Sample};
use super::nodes::{Colours, Nodes};
use super::places::{ABREAST, MostOrders};
use super::sums::AtlasSums;
use crate::error::Result;
use crate::film::{AnnexFile, AnnexRows, StateHead};
use glam::DVec3;
use rayon::prelude::*;

/// What the annex of a state is called.
const NAME: &str = "atlas";
/// The most samples of a frontier.
const MOST_SAMPLES: u32 = 64;

/// What a state says of an atlas before its rows.
#[derive(Debug, PartialEq)]
struct Facts {
    most: MostOrders,
    /// The film's own point of the square.
    at: (f32, f32),
    passes: u32,
    groups: u32,
    frontier: Frontier,
    colour: ColourSpread,
}

impl Facts {
    fn to_bytes(&self) -> Vec<u8> {
        let Self { most: MostOrders { n, m, cut }, at, passes, groups, frontier, colour } = self;
        let mut bytes = vec![*n, *m, u8::from(*cut)];
        [at.0, at.1].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        let samples = frontier.samples();
        [*passes, *groups, samples.len() as u32].iter().for_each(|count| bytes.extend(count.to_le_bytes()));
        let samples = samples.iter().flat_map(|Sample { t, kappa, error }| [*t, *kappa, *error]);
        let spread = colour.spread.iter().flat_map(DVec3::to_array);
        samples.chain(spread).for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes
    }

    /// None: they are not such.
    fn of_bytes(mut bytes: &[u8]) -> Option<Self> {
        let bytes = &mut bytes;
        let [n, m, cut] = taken(bytes)?;
        let mut real = || Some(f32::from_le_bytes(taken(bytes)?)).filter(|x| (0.0..=1.0).contains(x));
        let at = (real()?, real()?);
        let mut count = || Some(u32::from_le_bytes(taken(bytes)?));
        let (passes, groups) = (count()?, count()?);
        let samples = count().filter(|samples| *samples <= MOST_SAMPLES)?;
        let mut real = || Some(f64::from_le_bytes(taken(bytes)?));
        let samples = (0..samples).map(|_| Some(Sample { t: real()?, kappa: real()?, error: real()? }));
        let frontier = Frontier::from_samples(samples.collect::<Option<_>>()?)?;
        let mut colour = ColourSpread::default();
        for spread in &mut colour.spread {
            *spread = DVec3::new(real()?, real()?, real()?);
        }
        let most = MostOrders { n, m, cut: cut == 1 };
        // Some of all powers are stored, and these are the last of them.
        let nodes = Nodes::up_to(n).last() == n && Nodes::up_to(m).last() == m;
        let counted = groups <= passes && (groups > 0) == (passes > 0);
        (nodes && counted && cut <= 1 && bytes.is_empty()).then_some(Self {
            most,
            at,
            passes,
            groups,
            frontier,
            colour,
        })
    }
}

fn taken<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
    let (first, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(*first)
}

/// What is wrong with facts that cannot be read.
const NO_FACTS: &str = "what it says of its atlas makes no sense";

impl AtlasSums {
    /// Gives `store` the sums as the annex of a state.
    pub fn as_annex<T>(&self, store: impl FnOnce(&AnnexRows<'_>) -> T) -> T {
        let records = self.row_records();
        let row = |y: usize| {
            let numbers = self.records[y * records..][..records].as_flattened().as_flattened();
            numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
        };
        let facts = Facts {
            most: self.most,
            at: self.at,
            passes: self.passes,
            groups: self.groups,
            frontier: self.tables.frontier.clone(),
            colour: self.colour,
        };
        let row_bytes = (records * size_of::<Colours>()) as u32;
        store(&AnnexRows { name: NAME, facts: facts.to_bytes(), row_bytes, row: &row })
    }

    /// The sums of a state whose film was read; nothing else is known of them. They take as much memory as [`bytes_of`](Self::bytes_of)
    /// says.
    ///
    /// # Errors
    /// One line: they are damaged, or of something else.
    pub fn of_annex(mut file: AnnexFile) -> Result<Self> {
        let facts = facts(&mut file)?;
        let (width, height) = (file.head().width, file.head().height);
        // Before there is a place for all of them.
        let promised = file.head().annex.as_ref().map(|annex| annex.row as usize);
        if promised != Some(Self::bytes((width, 1), facts.most)) {
            return Err(file.refused(NO_FACTS));
        }
        let mut sums = Self::new((width, height), facts.most, facts.at, facts.frontier.clone());
        sums.take(facts, file)?;
        Ok(sums)
    }

    /// Bytes that the annex of a state takes in memory; zero without one.
    pub fn bytes_of(head: &StateHead) -> usize {
        head.annex.as_ref().map_or(0, |annex| annex.row as usize * head.height as usize)
    }

    /// Goes on from a state whose film was read: before the first pass.
    ///
    /// # Errors
    /// One line: they are damaged, or of another atlas.
    pub fn go_on(&mut self, mut file: AnnexFile) -> Result<()> {
        assert_eq!(self.passes, 0, "sums of an atlas are not added to others");
        let facts = facts(&mut file)?;
        if (facts.most, facts.at) != (self.most, self.at) || facts.frontier != self.tables.frontier {
            return Err(file.refused("its atlas is counted in another way"));
        }
        self.take(facts, file)
    }

    /// Fills the rows.
    fn take(&mut self, Facts { passes, groups, colour, .. }: Facts, mut file: AnnexFile) -> Result<()> {
        let records = self.row_records();
        for row in self.records.chunks_mut(records) {
            let bytes = file.row()?;
            let numbers = row.as_flattened_mut().as_flattened_mut();
            if bytes.len() != size_of_val(numbers) {
                return Err(file.refused(NO_FACTS));
            }
            let from = bytes.par_chunks_exact(size_of::<f32>());
            numbers.par_iter_mut().zip(from).with_min_len(1 << 14).for_each(|(x, bytes)| {
                *x = f32::from_le_bytes(bytes.try_into().expect("four of them"));
            });
        }
        file.end()?;
        (self.passes, self.groups, self.colour) = (passes, groups, colour);
        Ok(())
    }

    /// Colours of a row of the picture.
    fn row_records(&self) -> usize {
        (self.width as usize).div_ceil(ABREAST) * self.tables.record()
    }
}

/// The facts of an annex that is an atlas, of as many passes as its film, which are the first.
fn facts(file: &mut AnnexFile) -> Result<Facts> {
    let head = file.head();
    let is_atlas = head.annex.as_ref().is_some_and(|annex| annex.name == NAME);
    // The first number that is missing.
    let (passes, first) = (head.passes.len(), head.passes.next_missing(0));
    if !is_atlas {
        return Err(file.refused("it is of no atlas"));
    }
    let facts = Facts::of_bytes(file.facts()?);
    facts.filter(|facts| facts.passes == passes && passes == first).ok_or_else(|| file.refused(NO_FACTS))
}

#[cfg(test)]
#[path = "state_tests.rs"]
mod tests;
