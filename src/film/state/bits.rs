//! Numbers of some bits each, one after the other, from the lowest bit of the first byte up.

/// How many bits a number takes.
pub(in crate::film) fn width_of(number: u32) -> u32 {
    u32::BITS - number.leading_zeros()
}

/// Bytes that are filled bit by bit.
pub(in crate::film) struct Writer<'a> {
    bytes: &'a mut Vec<u8>,
    held: u64,
    count: u32,
}

impl<'a> Writer<'a> {
    /// Goes on after what is there.
    pub fn new(bytes: &'a mut Vec<u8>) -> Self {
        Self { bytes, held: 0, count: 0 }
    }

    /// The lowest `bits` bits of a number, 32 at most; those above must be zero.
    #[inline]
    pub fn put(&mut self, number: u32, bits: u32) {
        debug_assert!(bits == 32 || number >> bits == 0, "{number} in {bits} bits");
        self.held |= u64::from(number) << self.count;
        self.count += bits;
        while self.count >= 8 {
            self.bytes.push(self.held as u8);
            self.held >>= 8;
            self.count -= 8;
        }
    }

    /// Zeros up to the end of the byte.
    pub fn finish(self) {
        if self.count > 0 {
            self.bytes.push(self.held as u8);
        }
    }
}

/// The same numbers again.
pub(in crate::film) struct Reader<'a> {
    bytes: &'a [u8],
    held: u64,
    count: u32,
}

impl<'a> Reader<'a> {
    /// From the first byte on.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, held: 0, count: 0 }
    }

    /// The next number of `bits` bits, 32 at most. None: there are not so many left.
    #[inline]
    pub fn take(&mut self, bits: u32) -> Option<u32> {
        while self.count < bits {
            let (first, rest) = self.bytes.split_first()?;
            self.held |= u64::from(*first) << self.count;
            self.count += 8;
            self.bytes = rest;
        }
        let number = self.held & ((1 << bits) - 1);
        self.held >>= bits;
        self.count -= bits;
        Some(number as u32)
    }

    /// What comes after the byte that is under way. None: the rest of that byte is not zero.
    pub fn finish(self) -> Option<&'a [u8]> {
        (self.held == 0).then_some(self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_any_length_come_back() {
        let numbers: Vec<(u32, u32)> = (0..500_u32)
            .map(|i| (i.wrapping_mul(0x9E37_79B9), i % 33))
            .map(|(number, bits)| (if bits == 32 { number } else { number & ((1 << bits) - 1) }, bits))
            .collect();
        let mut bytes = vec![7];
        let mut writer = Writer::new(&mut bytes);
        numbers.iter().for_each(|(number, bits)| writer.put(*number, *bits));
        writer.finish();
        let all: u32 = numbers.iter().map(|(_, bits)| bits).sum();
        assert_eq!(bytes.len(), 1 + all.div_ceil(8) as usize);
        bytes.push(9);
        let mut reader = Reader::new(&bytes[1..]);
        for (number, bits) in &numbers {
            assert_eq!(reader.take(*bits), Some(*number));
        }
        assert_eq!(reader.finish(), Some(&[9][..]));
        assert_eq!(Reader::new(&[1]).take(9), None);
        let mut half = Reader::new(&[0xf0]);
        assert_eq!((half.take(4), half.finish()), (Some(0), None));
    }
}
