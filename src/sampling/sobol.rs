use super::hash;

/// How many dimensions [`Sobol`] has.
pub const SOBOL_DIMENSIONS: usize = 10;

/// Primitive polynomials and initial direction numbers of dimensions 2…10: (degree, coefficients, m).
/// S. Joe & F. Y. Kuo 2008, "Constructing Sobol sequences with better two-dimensional projections".
const JOE_KUO: [(u32, u32, &[u32]); SOBOL_DIMENSIONS - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
];

/// Of each dimension and each hexadecimal digit of the index, whose bits are in reverse: what the digit's value adds, by
/// exclusive or, to the number, whose bits are in reverse too. The scrambling wants them so.
static DIGITS: [[[u32; 16]; 8]; SOBOL_DIMENSIONS] = digits();

const fn digits() -> [[[u32; 16]; 8]; SOBOL_DIMENSIONS] {
    let directions = directions();
    let mut table = [[[0_u32; 16]; 8]; SOBOL_DIMENSIONS];
    let mut d = 0;
    while d < SOBOL_DIMENSIONS {
        let mut bit = 0;
        while bit < 32 {
            let mut value = 0;
            while value < 16 {
                if value >> (bit % 4) & 1 == 1 {
                    table[d][bit / 4][value] ^= directions[d][31 - bit].reverse_bits();
                }
                value += 1;
            }
            bit += 1;
        }
        d += 1;
    }
    table
}

const fn directions() -> [[u32; 32]; SOBOL_DIMENSIONS] {
    let mut v = [[0_u32; 32]; SOBOL_DIMENSIONS];
    let mut i = 0;
    while i < 32 {
        v[0][i] = 1 << (31 - i);
        i += 1;
    }
    let mut d = 1;
    while d < SOBOL_DIMENSIONS {
        let (degree, a, m) = JOE_KUO[d - 1];
        let s = degree as usize;
        let mut i = 0;
        while i < 32 {
            if i < s {
                v[d][i] = m[i] << (31 - i);
            } else {
                v[d][i] = v[d][i - s] ^ (v[d][i - s] >> s);
                let mut k = 1;
                while k < s {
                    v[d][i] ^= ((a >> (s - 1 - k)) & 1) * v[d][i - k];
                    k += 1;
                }
            }
            i += 1;
        }
        d += 1;
    }
    v
}

/// An Owen-scrambled Sobol sequence of `D` dimensions, at most [`SOBOL_DIMENSIONS`], and 2³² points.
///
/// Each scramble (a function of `key`) is a random net: points of one key are stratified against each other,
/// means over different keys are independent and unbiased. Hash-based nested uniform scrambling: B. Burley 2020,
/// "Practical hash-based Owen scrambling", with the mix of N. Vegdahl 2021.
#[derive(Clone, Copy, Debug)]
pub struct Sobol<const D: usize = SOBOL_DIMENSIONS> {
    index_seed: u32,
    seeds: [u32; D],
}

impl Sobol {
    /// The sequence scrambled by `key`.
    pub fn new(key: u64) -> Self {
        Self::of_dimensions(key)
    }
}

impl<const D: usize> Sobol<D> {
    /// The first `D` dimensions of the sequence scrambled by `key`, without the work of the others.
    pub fn of_dimensions(key: u64) -> Self {
        const { assert!(D <= SOBOL_DIMENSIONS) };
        let seeds = std::array::from_fn(|d| hash(key ^ hash(d as u64 + 1)) as u32);
        Self { index_seed: hash(key ^ hash(0)) as u32, seeds }
    }

    /// Point `index`, dimensions `first..first + N`, each in [0, 1).
    pub fn point<const N: usize>(&self, index: u32, first: usize) -> [f32; N] {
        // Scrambling the index shuffles the points and maps every prefix of 2^m onto an aligned block, which is a net.
        let shuffled = scramble_reversed(index.reverse_bits(), self.index_seed);
        std::array::from_fn(|k| {
            let d = first + k;
            let digit = |i: usize| DIGITS[d][i][(shuffled >> (4 * i) & 15) as usize];
            let x = (0..8).fold(0, |x, i| x ^ digit(i));
            let x = scramble_reversed(x, self.seeds[d]).reverse_bits();
            (x >> 8) as f32 * (1.0 / 16_777_216.0)
        })
    }
}

/// Nested uniform scrambling of a base-2 fraction whose first digit is the lowest bit.
fn scramble_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_dimension_is_stratified_in_every_power_of_two() {
        let sobol = Sobol::new(7);
        for d in 0..SOBOL_DIMENSIONS {
            for m in [4_u32, 8, 12] {
                let n = 1_usize << m;
                let mut seen = vec![false; n];
                for i in 0..n as u32 {
                    let [x] = sobol.point::<1>(i, d);
                    let cell = (f64::from(x) * n as f64) as usize;
                    assert!(!seen[cell], "dimension {d}: cell {cell} of {n} hit twice");
                    seen[cell] = true;
                }
            }
        }
    }

    #[test]
    fn the_first_two_dimensions_are_a_net() {
        let sobol = Sobol::new(3);
        let m = 8;
        for split in 0..=m {
            let (columns, rows) = (1 << split, 1 << (m - split));
            let mut seen = vec![false; 1 << m];
            for i in 0..1 << m {
                let [x, y] = sobol.point::<2>(i, 0);
                let cell = (x * columns as f32) as usize * rows + (y * rows as f32) as usize;
                assert!(!seen[cell]);
                seen[cell] = true;
            }
        }
    }

    #[test]
    fn different_keys_give_independent_means() {
        // f(x, y) = x y has mean 1/4; the mean over scrambles must be unbiased and nearly exact for each net.
        let means: Vec<f64> = (0..64)
            .map(|key| {
                let sobol = Sobol::new(key);
                (0..1024).map(|i| sobol.point::<2>(i, 3)).map(|[x, y]| f64::from(x * y)).sum::<f64>() / 1024.0
            })
            .collect();
        let mean = means.iter().sum::<f64>() / 64.0;
        let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 63.0;
        let random_variance = (1.0 / 9.0 - 1.0 / 16.0) / 1024.0;
        assert!(variance < random_variance / 50.0, "variance {variance} against {random_variance} at random");
        assert!((mean - 0.25).abs() < 3.5 * (variance / 64.0).sqrt() + 1e-7);
    }
}
