//! Properties that hold for all inputs: the algebra of halves, and lobes.

mod algebra;
mod epsilons;
mod lobes;
