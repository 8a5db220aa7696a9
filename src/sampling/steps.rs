//! Densities over [0, 1) that are constant in each of N equal parts.

/// Sums of the weights up to and with each, the last exactly one.
pub fn cumulative<const N: usize>(weight: impl Fn(usize) -> f32) -> [f32; N] {
    let mut sums = [0.0; N];
    let mut sum = 0.0;
    for (i, to) in sums.iter_mut().enumerate() {
        sum += weight(i);
        *to = sum;
    }
    let mut sums = sums.map(|to| to / sum);
    sums[N - 1] = 1.0;
    sums
}

/// The part that an even number falls in, the number it becomes, and its density there.
pub fn invert<const N: usize>(cumulative: &[f32; N], u: f32) -> (usize, f32, f32) {
    // Counting all is faster than a search whose steps wait for each other.
    let part = cumulative.iter().map(|c| u32::from(*c <= u)).sum::<u32>().min(N as u32 - 1) as usize;
    let below = if part == 0 { 0.0 } else { cumulative[part - 1] };
    let probability = cumulative[part] - below;
    let within = (u - below) / probability;
    let x = (part as f32 + within) / N as f32;
    (part, x.min(1.0 - f32::EPSILON), probability * N as f32)
}

/// The part that a number in [0, 1) lies in, and the density there.
pub fn density<const N: usize>(cumulative: &[f32; N], x: f32) -> (usize, f32) {
    let part = ((x * N as f32) as usize).min(N - 1);
    let below = if part == 0 { 0.0 } else { cumulative[part - 1] };
    (part, (cumulative[part] - below) * N as f32)
}
