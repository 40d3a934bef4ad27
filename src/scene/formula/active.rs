//! Arguments of `exp`, `tanh` and of powers with exponents that change: these functions are constant beside
//! rounding but for a window of their arguments, however smooth these are.  A pulse as
//! `exp(-((t - 2)/0.01)^2)` is nothing to any method whose steps do not come into its window; its argument is
//! a parabola, which tells where that is.

use super::branches::BySign;
use super::{Formula, Node};
use crate::arithmetic::scratch::with_copies;

/// Half the window of an argument in its units: of `exp` and powers from -40 to 40, of `tanh` from -20 to 20.
pub(crate) const WINDOW: f64 = 10.0;
/// These units.
const OF_EXPONENTIALS: f64 = 4.0;
const OF_TANGENTS: f64 = 2.0;

/// An argument: that of `exp` or `tanh` at a node, or an exponent at a node and its base at another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ActiveArgument {
    node: usize,
    base: Option<usize>,
    unit: f64,
}

impl Formula {
    /// Notes the arguments that change with more than these names, by number.
    pub(crate) fn note_active_arguments(&mut self, is_fixed: impl Fn(usize) -> bool) {
        let mut varies: Vec<bool> = Vec::with_capacity(self.nodes.len());
        self.active.clear();
        for &node in &self.nodes {
            let argument = match node {
                Node::Exponential(node) => Some((node, None, OF_EXPONENTIALS)),
                Node::HyperbolicTangent(node) => Some((node, None, OF_TANGENTS)),
                Node::Power(base, node) => Some((node, Some(base), OF_EXPONENTIALS)),
                _ => None,
            };
            if let Some((node, base, unit)) = argument.filter(|argument| varies[argument.0]) {
                self.active.push(ActiveArgument { node, base, unit });
            }
            let condition = match node {
                Node::Flip(condition, _) | Node::Select(condition, ..) => Some(self.conditions[condition]),
                _ => None,
            };
            let takes = node.operands().into_iter().flatten().chain(condition).any(|node| varies[node]);
            varies.push(takes || matches!(node, Node::Name(name) if !is_fixed(name)));
        }
    }

    /// True where it has any.
    pub(crate) fn has_active_arguments(&self) -> bool {
        !self.active.is_empty()
    }

    /// Appends them, in their units, on the branches that hold there.
    pub(crate) fn append_active_arguments(&self, values: &[f64], all: &mut Vec<f64>) {
        with_copies(0.0, self.nodes.len(), |results| {
            self.fill(results, values, &|_, value| value, &mut BySign);
            all.extend(self.active.iter().map(|argument| {
                let logarithm = argument.base.map_or(1.0, |base| libm::log(results[base]));
                results[argument.node] * logarithm / argument.unit
            }));
        });
    }
}
