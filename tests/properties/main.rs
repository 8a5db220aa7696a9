//! Properties that hold for all inputs (the algebra of halves, lobes) and for the sources (dependencies, constants, imports).

mod algebra;
mod dependencies;
mod epsilons;
mod lobes;
mod order;
mod rough;
