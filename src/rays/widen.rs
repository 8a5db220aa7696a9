use super::leaf::LANES;
use super::node::WIDTH;
use obvhs::bvh2::Bvh2;

/// How a binary tree becomes an eight-wide one at the least expected cost per ray (Ylitie, Karras, Laine 2017,
/// "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", §3.1): which binary nodes become wide
/// nodes, which vanish between them, which are leaves with all that is below them.
pub(super) struct Widening<'a> {
    binary: &'a Bvh2,
    /// `cost[node][i]`: of what is below `node`, shown to its wide parent as at most i + 1 children.
    cost: Vec<[f32; WIDTH]>,
    /// As a leaf.
    leaf_cost: Vec<f32>,
}

/// What a wide node costs, in block tests: of 1.5, 3 and 5 the fastest rays on the bench's scene, all within 8 %.
const NODE_COST: f32 = 3.0;
/// What a leaf costs beyond its blocks. Between 0 and 1 it makes no difference that can be measured.
const LEAF_COST: f32 = 0.5;
/// Leaves of more triangles are not formed, unless they lie in one box.
const MOST: u32 = 2 * LANES as u32;

impl<'a> Widening<'a> {
    /// `size`: triangles of a primitive.
    pub fn new(binary: &'a Bvh2, size: impl Fn(u32) -> u32) -> Self {
        let count = binary.nodes.len();
        let mut widening =
            Self { binary, cost: vec![[0.0; WIDTH]; count], leaf_cost: vec![f32::INFINITY; count] };
        let mut sizes = vec![0; count];
        let order: Vec<usize> = widening.below(0).collect();
        for node in order.into_iter().rev() {
            let surface = binary.nodes[node].aabb().half_area();
            if binary.nodes[node].is_leaf() {
                sizes[node] = primitives(binary, node).iter().map(|&primitive| size(primitive)).sum();
                let cost = surface * (LEAF_COST + sizes[node].div_ceil(LANES as u32) as f32);
                widening.leaf_cost[node] = cost;
                widening.cost[node] = [cost; WIDTH];
                continue;
            }
            let [left, right] = pair(binary, node);
            sizes[node] = sizes[left] + sizes[right];
            if sizes[node] <= MOST {
                let blocks = sizes[node].div_ceil(LANES as u32) as f32;
                widening.leaf_cost[node] = surface * (LEAF_COST + blocks);
            }
            let mut cost = std::array::from_fn(|i| if i == 0 { 0.0 } else { widening.split(node, i).1 });
            cost[0] = widening.leaf_cost[node].min(surface * NODE_COST + cost[WIDTH - 1]);
            for i in 1..WIDTH {
                cost[i] = cost[i].min(cost[i - 1]);
            }
            widening.cost[node] = cost;
        }
        widening
    }

    /// The best way to share i + 1 children among the two below: the left one's share less one, and the cost.
    fn split(&self, node: usize, i: usize) -> (usize, f32) {
        let [left, right] = pair(self.binary, node);
        (0..i)
            .map(|k| (k, self.cost[left][k] + self.cost[right][i - 1 - k]))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .expect("there are two children or more")
    }

    /// True when all below this child of a wide node is one leaf.
    pub fn is_leaf(&self, node: usize) -> bool {
        self.leaf_cost[node] <= self.cost[node][0]
    }

    /// The children of a wide node.
    pub fn children(&self, node: usize) -> Vec<usize> {
        let mut children = Vec::with_capacity(WIDTH);
        let mut open = self.share(node, WIDTH - 1).to_vec();
        while let Some((node, mut i)) = open.pop() {
            // Fewer may cost as little.
            while i > 0 && self.cost[node][i] >= self.cost[node][i - 1] {
                i -= 1;
            }
            if i == 0 {
                children.push(node);
            } else {
                open.extend(self.share(node, i));
            }
        }
        children
    }

    fn share(&self, node: usize, i: usize) -> [(usize, usize); 2] {
        let [left, right] = pair(self.binary, node);
        let (k, _) = self.split(node, i);
        [(left, k), (right, i - 1 - k)]
    }

    /// This node and all below it, parents first.
    pub fn below(&self, node: usize) -> impl Iterator<Item = usize> + use<'a> {
        let binary = self.binary;
        let mut open = vec![node];
        std::iter::from_fn(move || {
            let node = open.pop()?;
            if !binary.nodes[node].is_leaf() {
                open.extend(pair(binary, node));
            }
            Some(node)
        })
    }
}

/// The primitives of a leaf.
pub(super) fn primitives(binary: &Bvh2, leaf: usize) -> &[u32] {
    let node = &binary.nodes[leaf];
    &binary.primitive_indices[node.first_index as usize..][..node.prim_count as usize]
}

fn pair(binary: &Bvh2, node: usize) -> [usize; 2] {
    let first = binary.nodes[node].first_index as usize;
    [first, first + 1]
}
