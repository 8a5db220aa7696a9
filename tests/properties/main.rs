//! Properties that hold for all inputs: the algebra of halves, and lobes.

mod algebra;
mod dependencies;
mod epsilons;
mod lobes;
mod order;
