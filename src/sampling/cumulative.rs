//! One of many things, chosen in proportion to its weight.

/// Running sums of weights.
#[derive(Clone, Debug, Default)]
pub struct Cumulative {
    sums: Vec<f64>,
}

impl Cumulative {
    /// Of weights, none below zero.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let add = |weight| {
            sum += weight;
            sum
        };
        Self { sums: weights.into_iter().map(add).collect() }
    }

    /// How many things there are.
    pub fn len(&self) -> usize {
        self.sums.len()
    }

    /// True where there is nothing to choose from.
    pub fn is_empty(&self) -> bool {
        self.sums.is_empty()
    }

    /// The sum of all weights.
    pub fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// The thing that `x` in [0, total) falls on, of one or more; never one without weight, but for what rounding does at the end.
    pub fn index(&self, x: f64) -> usize {
        self.sums.partition_point(|sum| *sum <= x).min(self.sums.len() - 1)
    }

    /// The sum of the weights before a thing.
    pub fn below(&self, index: usize) -> f64 {
        if index == 0 { 0.0 } else { self.sums[index - 1] }
    }

    /// The weight of a thing.
    pub fn weight(&self, index: usize) -> f64 {
        self.sums[index] - self.below(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_are_chosen_in_proportion_and_those_without_weight_never() {
        let weights = [0.0, 0.25, 0.0, 0.5, 0.25, 0.0];
        let choice = Cumulative::new(weights);
        let n = 4000;
        let mut met = [0.0; 6];
        (0..n).for_each(|i| met[choice.index(choice.total() * (f64::from(i) + 0.5) / f64::from(n))] += 1.0);
        assert_eq!(met.map(|count| count / f64::from(n)), weights);
        assert!((0..6).all(|i| choice.weight(i) == weights[i]) && choice.below(4) == 0.75);
        assert!(choice.len() == 6 && !choice.is_empty() && Cumulative::default().is_empty());
        assert_eq!(Cumulative::default().total(), 0.0);
    }
}
