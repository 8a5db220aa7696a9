//! Which triangles share an edge: a table of directed edges by their first vertex.

use glam::Vec3;
use rayon::prelude::*;

/// For each vertex the first of those at the same place. Places are the same where they are bit for bit; + 0.0 makes
/// −0.0 equal to 0.0.
pub(super) fn weld(positions: &[Vec3]) -> Vec<u32> {
    let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut sorted: Vec<([u32; 3], u32)> =
        positions.par_iter().enumerate().map(|(i, p)| (key(*p), i as u32)).collect();
    sorted.par_sort_unstable();
    let mut welded = vec![0; positions.len()];
    let mut first = ([0; 3], 0);
    for (n, &(key, vertex)) in sorted.iter().enumerate() {
        if n == 0 || key != first.0 {
            first = (key, vertex);
        }
        welded[vertex as usize] = first.1;
    }
    welded
}

/// Directed edges of triangles.
pub(super) struct Edges {
    /// For each vertex where its edges begin in the list; one more at the end.
    first: Vec<u32>,
    /// Where each edge ends, and its triangle; those of one vertex in order.
    to: Vec<(u32, u32)>,
}

impl Edges {
    /// The edges of triangles 0, 1, …, given by their sides (from, to), among so many vertices.
    pub fn of(vertices: usize, sides: impl Iterator<Item = [(u32, u32); 3]> + Clone) -> Self {
        let mut first = vec![0; vertices + 1];
        for (from, _) in sides.clone().flatten() {
            first[from as usize + 1] += 1;
        }
        for vertex in 0..vertices {
            first[vertex + 1] += first[vertex];
        }
        let mut next = first.clone();
        let mut to = vec![(0, 0); first[vertices] as usize];
        for (triangle, sides) in (0..).zip(sides) {
            for (from, end) in sides {
                to[next[from as usize] as usize] = (end, triangle);
                next[from as usize] += 1;
            }
        }
        for vertex in 0..vertices {
            to[first[vertex] as usize..first[vertex + 1] as usize].sort_unstable();
        }
        Self { first, to }
    }

    /// The triangles with an edge from one vertex to another.
    pub fn between(&self, from: u32, to: u32) -> impl Iterator<Item = u32> {
        let edges = &self.to[self.first[from as usize] as usize..self.first[from as usize + 1] as usize];
        let begin = edges.partition_point(|edge| edge.0 < to);
        edges[begin..].iter().take_while(move |edge| edge.0 == to).map(|edge| edge.1)
    }
}

/// Sets of triangles that are joined to each other.
pub(super) struct Joined(Vec<u32>);

impl Joined {
    /// So many, each alone.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// The one that stands for the set of a triangle; ways there become shorter.
    fn root(&mut self, mut of: u32) -> u32 {
        while self.0[of as usize] != of {
            let next = self.0[self.0[of as usize] as usize];
            self.0[of as usize] = next;
            of = next;
        }
        of
    }

    /// Makes two sets one.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // The lower stands for both, so that names do not depend on the order.
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// The name of the set of each.
    pub fn names(mut self) -> Vec<u32> {
        (0..self.0.len() as u32).map(|of| self.root(of)).collect()
    }
}
