//! Constraint equations of hinge trees: what each row's force asks of the hinges on its way to the ground,
//! and S = G M⁻¹ Gᵀ from that.
//!
//! ```text
//! M = L D Lᵀ,  e_r = L⁻¹ G_rᵀ:     S_rs = Σ e_r e_s / d      over the coordinates on both rows' ways
//! S lambda = Σ e_r e_0 / d + gamma_r,   e = e_0 - Σ lambda_r e_r,   then one outward pass
//! ```
//!
//! The inward pass of a row runs over the bodies between its points and the ground alone, so S couples two
//! rows only where both hang on one branch: S is kept in its envelope, the rows in an order that keeps it
//! small.

use super::{Links, Recursive};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::envelope::{Envelope, compact_order};
use crate::dynamics::rank::{Metric, RankVerdict};
use crate::dynamics::schur::{DROPPED, NEAR, Weakest};

/// One coordinate on a row's way to the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RowCoordinate {
    /// The coordinate.
    coordinate: usize,
    /// Place of the body; 0 for the coordinates of an origin.
    link: usize,
    /// How many steps on the one is that bears it; 0: the ground.
    onto: usize,
}

/// The ways of all rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ways {
    /// Outer bodies first, row by row.
    steps: Vec<RowCoordinate>,
    /// Where each row's steps begin, and where the last one's end.
    first: Vec<usize>,
    /// Place of each row in S.
    place: Vec<usize>,
    /// The row at each place.
    order: Vec<usize>,
    /// The shape of S.
    envelope: Envelope,
    /// Rows that cross at a coordinate: their places in S, rising, and their steps.
    crossings: Vec<(usize, usize)>,
    /// A coordinate, and where its crossings end.
    crossed: Vec<(usize, usize)>,
}

impl Ways {
    /// The ways of rows that depend on these coordinates.
    pub fn new(links: &Links, rows: &[Vec<usize>]) -> Self {
        let mut ways = Self { first: vec![0], ..Self::default() };
        let mut branches = Vec::with_capacity(rows.len());
        for coordinates in rows {
            branches.push(ways.push(links, coordinates));
        }
        ways.place = compact_order(&branches);
        ways.order = vec![0; rows.len()];
        for (row, &place) in ways.place.iter().enumerate() {
            ways.order[place] = row;
        }
        let mut first: Vec<usize> = (0..rows.len()).collect();
        let mut earliest = std::collections::BTreeMap::new();
        for (&place, branches) in ways.place.iter().zip(&branches) {
            for &branch in branches {
                let least = earliest.entry(branch).or_insert(place);
                *least = place.min(*least);
            }
        }
        for (&place, branches) in ways.place.iter().zip(&branches) {
            first[place] = branches.iter().map(|branch| earliest[branch]).fold(place, usize::min);
        }
        ways.envelope = Envelope::new(&first);
        let mut crossings: Vec<(usize, usize, usize)> = Vec::with_capacity(ways.steps.len());
        for row in 0..rows.len() {
            crossings.extend(ways.range(row).map(|at| (ways.steps[at].coordinate, ways.place[row], at)));
        }
        crossings.sort_unstable();
        for (at, &(coordinate, place, step)) in crossings.iter().enumerate() {
            ways.crossings.push((place, step));
            match ways.crossed.last_mut() {
                Some((same, end)) if *same == coordinate => *end = at + 1,
                _ => ways.crossed.push((coordinate, at + 1)),
            }
        }
        ways
    }

    /// Adds a row's way; the bodies and translational coordinates on the ground that it ends at.
    fn push(&mut self, links: &Links, coordinates: &[usize]) -> Vec<usize> {
        let bodies = links.bodies();
        let mut on_way = std::collections::BTreeSet::new();
        let mut translations = std::collections::BTreeSet::new();
        for &coordinate in coordinates {
            if coordinate >= bodies {
                translations.insert(coordinate - (coordinate - bodies) % 2);
                continue;
            }
            let mut at = links.place[coordinate];
            while at != 0 && on_way.insert(at) {
                if links.links[at].origin_point != 0 {
                    translations.insert(links.links[at].origin_point);
                }
                at = links.links[at].parent;
            }
        }
        let begin = self.steps.len();
        let (inwards, translations): (Vec<usize>, Vec<usize>) =
            (on_way.into_iter().rev().collect(), translations.into_iter().collect());
        let mut branches = translations.clone();
        for (at, &link) in inwards.iter().enumerate() {
            let here = &links.links[link];
            let onto = match (here.origin_point, here.parent) {
                (0, 0) => 0,
                (0, parent) => inwards[at..].iter().position(|&link| link == parent).unwrap_or(0),
                (origin_point, _) => translations
                    .iter()
                    .position(|&x| x == origin_point)
                    .map_or(0, |f| inwards.len() + 2 * f - at),
            };
            if (here.origin_point, here.parent) == (0, 0) {
                branches.push(here.body);
            }
            self.steps.push(RowCoordinate { coordinate: here.body, link, onto });
        }
        self.steps.extend(
            translations.iter().flat_map(|&x| [(x, 1), (x + 1, 0)]).map(|(coordinate, onto)| RowCoordinate {
                coordinate,
                link: 0,
                onto,
            }),
        );
        debug_assert_eq!(self.steps.len(), begin + inwards.len() + 2 * translations.len());
        self.first.push(self.steps.len());
        branches
    }

    /// The steps of a row.
    fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.first[row]..self.first[row + 1]
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.place.len()
    }

    /// Writes Σ e_r e_s p over the coordinates on both rows' ways, p by coordinates.
    #[inline]
    fn cross<T: Real>(&self, matrix: &mut [T], e: &[T], p: impl Fn(usize) -> T) {
        matrix.fill(T::ZERO);
        let mut begin = 0;
        for &(coordinate, end) in &self.crossed {
            let pivot = p(coordinate);
            let rows = &self.crossings[begin..end];
            for (last, &(i, at)) in rows.iter().enumerate() {
                let share = e[at] * pivot;
                for &(j, other) in &rows[..=last] {
                    self.envelope.add(matrix, i, j, share * e[other]);
                }
            }
            begin = end;
        }
    }

    /// Numbers in S.
    pub fn entries(&self) -> usize {
        self.envelope.entries()
    }

    /// Multiplications of an evaluation, about: those of the ways, of S and of its factors.
    pub fn cost(&self) -> usize {
        let mut cost = 12 * self.steps.len() + 2 * self.entries();
        let mut begin = 0;
        for &(_, end) in &self.crossed {
            let rows: usize = end - begin;
            cost += rows * (rows + 3) / 2;
            begin = end;
        }
        cost + self.envelope.cost()
    }
}

/// Rows at one moment; nothing is allocated after [`RecursiveRows::new`].
#[derive(Clone, Debug)]
pub struct RecursiveRows<T> {
    /// G, step by step.
    gradient: Vec<T>,
    /// e, step by step.
    excess: Vec<T>,
    /// Force and torque of what was passed on to each step of the row at hand.
    passed: Vec<(Complex<T>, T)>,
    /// S, then its factors.
    schur: Vec<T>,
    /// Reciprocal pivots of S.
    pivot: Vec<T>,
    /// What pivots are measured against.
    scale: Vec<f64>,
    /// What the rank of the rows is measured with.
    metric: Metric,
    /// A vector in the order of S.
    right: Vec<T>,
}

impl<T: Real> RecursiveRows<T> {
    /// Scratch space for the rows of these ways, with their
    /// [scales](crate::dynamics::row::ConstraintEquation::scale).
    pub fn new(ways: &Ways, scales: &[f64], metric: Metric) -> Self {
        let mut scale = vec![0.0; ways.rows()];
        for (&place, &of_row) in ways.place.iter().zip(scales) {
            scale[place] = of_row;
        }
        let longest = (0..ways.rows()).map(|row| ways.range(row).len()).max().unwrap_or(0);
        Self {
            gradient: vec![T::ZERO; ways.steps.len()],
            excess: vec![T::ZERO; ways.steps.len()],
            passed: vec![(Complex::ZERO, T::ZERO); longest],
            schur: vec![T::ZERO; ways.entries()],
            pivot: vec![T::ZERO; ways.rows()],
            scale,
            metric,
            right: vec![T::ZERO; ways.rows()],
        }
    }

    /// Takes a row's Jacobian out of `jacobian` (n), which is zero again afterwards.
    #[inline]
    pub fn take(&mut self, ways: &Ways, row: usize, jacobian: &mut [T]) {
        for at in ways.range(row) {
            let entry = &mut jacobian[ways.steps[at].coordinate];
            self.gradient[at] = std::mem::replace(entry, T::ZERO);
        }
    }

    /// The coordinates on a row's way and its Jacobian there.
    #[inline]
    pub fn gradient<'a>(&'a self, ways: &'a Ways, row: usize) -> impl Iterator<Item = (usize, T)> + 'a {
        ways.range(row).map(|at| (ways.steps[at].coordinate, self.gradient[at]))
    }

    /// G v of a row.
    #[inline]
    pub fn along(&self, ways: &Ways, row: usize, v: &[T]) -> T {
        self.gradient(ways, row).fold(T::ZERO, |sum, (k, g)| sum + g * v[k])
    }

    /// The inward passes of all rows and the factors of S, after [`take`](Self::take) for every row and
    /// [`Recursive::inward_pass`]; the weakest row.
    #[inline]
    pub fn factor_constraints(&mut self, ways: &Ways, trees: &Recursive<T>) -> Weakest {
        for row in 0..ways.rows() {
            self.reach(ways, trees, row);
        }
        ways.cross(&mut self.schur, &self.excess, |coordinate| trees.joints[coordinate].pivot);
        let mut weakest = ways.envelope.factor(&mut self.schur, &mut self.pivot, &self.scale);
        if weakest.share < NEAR {
            weakest = self.look_closer(ways, trees, weakest);
        }
        Weakest { row: ways.order.get(weakest.row).copied().unwrap_or(0), ..weakest }
    }

    /// What there is to do where pivots are small, see
    /// [`schur::look_closer`](crate::dynamics::schur::look_closer).
    #[cold]
    fn look_closer(&mut self, ways: &Ways, trees: &Recursive<T>, mass: Weakest) -> Weakest {
        let verdict = self.judge(ways);
        let before: Vec<f64> = self.pivot.iter().map(|pivot| pivot.value()).collect();
        let Self { schur, excess, scale, pivot, .. } = self;
        verdict.settle(mass, [&before, scale], |is_left_out| {
            ways.cross(schur, excess, |coordinate| trees.joints[coordinate].pivot);
            let Some(is_left_out) = is_left_out else {
                return ways.envelope.factor(schur, pivot, scale).share;
            };
            let mut weakest = Weakest::NONE;
            ways.envelope.factor_by(schur, pivot, |i, pivot| {
                weakest.reciprocal_kept(i, pivot, scale[i], is_left_out[i])
            });
            weakest.share
        })
    }

    /// The rank of the rows, in the order of S.
    pub fn judge(&self, ways: &Ways) -> RankVerdict {
        let gradient: Vec<f64> = self.gradient.iter().map(|gradient| gradient.value()).collect();
        let (mut matrix, mut shares) = (vec![0.0; ways.entries()], vec![0.0; ways.rows()]);
        let mut pivot = shares.clone();
        let metric = self
            .metric
            .beyond(|row| ways.range(row).map(|at| (ways.steps[at].coordinate, self.gradient[at].value())));
        ways.cross(&mut matrix, &gradient, |coordinate| metric.columns[coordinate]);
        ways.envelope.factor_by(&mut matrix, &mut pivot, |i, pivot: f64| {
            shares[i] = pivot / metric.rows[ways.order[i]];
            if shares[i] >= DROPPED { 1.0 / pivot } else { 0.0 }
        });
        let verdict = self.metric.verdict(&shares);
        if !self.metric.is_open(&verdict) {
            return verdict;
        }
        ways.cross(&mut matrix, &gradient, |coordinate| metric.columns[coordinate]);
        let rows: Vec<f64> = ways.order.iter().map(|&row| metric.rows[row]).collect();
        self.metric.pivoted(ways.envelope.full(&matrix), &rows)
    }

    /// The inward pass of one row.
    #[inline]
    fn reach(&mut self, ways: &Ways, trees: &Recursive<T>, row: usize) {
        let range = ways.range(row);
        let (steps, gradient) = (&ways.steps[range.clone()], &self.gradient[range.clone()]);
        let (excess, passed) = (&mut self.excess[range], &mut self.passed[..steps.len()]);
        passed.fill((Complex::ZERO, T::ZERO));
        for (k, step) in steps.iter().enumerate() {
            let (force, torque) = passed[k];
            if step.link == 0 {
                excess[k] = gradient[k] - force.re - torque;
                // The x of an origin hands the force over to its y.
                if step.onto != 0 {
                    passed[k + 1] = (
                        Complex::new(force.im, T::ZERO),
                        trees.joints[step.coordinate].moment.re * excess[k],
                    );
                }
                continue;
            }
            let (joint, lever) = (&trees.joints[step.coordinate], trees.places[step.link].lever);
            excess[k] = gradient[k] - torque;
            if step.onto != 0 {
                let felt = force + joint.moment.times(excess[k] * joint.pivot);
                let onto = &mut passed[k + step.onto];
                onto.0 += felt;
                // Nothing turns about an origin.
                if steps[k + step.onto].link != 0 {
                    onto.1 += lever.dot(felt);
                }
            }
        }
    }

    /// Adds G a of every row, a the accelerations of the load whose e are in place.
    #[inline]
    pub fn project(&self, ways: &Ways, trees: &Recursive<T>, along: &mut [T]) {
        for (row, along) in along.iter_mut().enumerate().take(ways.rows()) {
            for at in ways.range(row) {
                let joint = &trees.joints[ways.steps[at].coordinate];
                *along += self.excess[at] * (joint.pivot * joint.excess);
            }
        }
    }

    /// Solves S x = x in place, in the scene's order.
    #[inline]
    pub fn solve(&mut self, ways: &Ways, x: &mut [T]) {
        for (&place, x) in ways.place.iter().zip(x.iter()) {
            self.right[place] = *x;
        }
        ways.envelope.solve(&self.schur, &self.pivot, &mut self.right);
        for (&place, x) in ways.place.iter().zip(x) {
            *x = self.right[place];
        }
    }

    /// True where a row was left out.
    pub fn is_left_out(&self, ways: &Ways, row: usize) -> bool {
        self.pivot[ways.place[row]] == T::ZERO
    }

    /// Takes Gᵀ lambda off the load whose e are in place.
    #[inline]
    pub fn resist(&self, ways: &Ways, trees: &mut Recursive<T>, multiplier: &[T]) {
        for (row, &multiplier) in multiplier.iter().enumerate().take(ways.rows()) {
            for at in ways.range(row) {
                trees.joints[ways.steps[at].coordinate].excess -= self.excess[at] * multiplier;
            }
        }
    }
}
