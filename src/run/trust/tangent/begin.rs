//! A tangent flow made, at the start of a motion or from where an earlier one stopped.

use super::beside;
use super::gauss::{self, TangentGauss};
use super::ground::Ground;
use super::start::{Dice, unit};
use super::{INPUTS, Path, TangentFlow, VECTORS, WHOLE};
use crate::dynamics::{Coordinates, Mechanism, Motion};
use crate::run::build::tangent_form;
use crate::run::saltation::set_by_events;
use crate::run::trust::DistanceMetric;
use std::sync::Arc;

impl TangentFlow {
    /// The flow from a motion of a mechanism with the contacts held there.
    ///
    /// # Errors
    /// Why there is none: all is driven, or the matrices would be too large.
    pub fn new(mechanism: &Arc<Mechanism>, motion: &Motion, until: f64) -> Result<Self, String> {
        Self::of(mechanism, motion, until, false)
    }

    /// The same with the whole matrix, and by the series, whatever that costs.
    ///
    /// # Errors
    /// See [`TangentFlow::new`].
    pub fn whole(mechanism: &Arc<Mechanism>, motion: &Motion, until: f64) -> Result<Self, String> {
        Self::of(mechanism, motion, until, true)
    }

    fn of(mechanism: &Arc<Mechanism>, motion: &Motion, until: f64, is_exact: bool) -> Result<Self, String> {
        if mechanism.vibration.is_some() {
            return Err("the mean force of a vibration has no tangent flow".into());
        }
        let mut tangent = Self::bare(mechanism)?;
        let f = tangent.weights.len();
        let state = tangent.problem.state(motion);
        let rows = tangent.ground.as_mut().map_or(0, |ground| ground.stand(mechanism, &state));
        // Neighbours stick at other places.
        let sticking = mechanism.sticking();
        let freedom = (f + sticking).saturating_sub(rows);
        if freedom == 0 {
            return Err("nothing is free to move: neighbouring motions are the same".into());
        }
        // What switches may tie coordinates later.
        let is_free = tangent.ground.is_none() && mechanism.contacts.is_empty() && !mechanism.is_switched();
        let is_whole = (is_exact || f <= WHOLE) && is_free;
        let is_plain = is_whole
            && !is_exact
            && mechanism.constraints.is_empty()
            && !mechanism.is_forced()
            && gauss::is_slow(mechanism);
        let all = (2 * freedom).saturating_sub(sticking);
        let count = if is_whole || freedom <= WHOLE { all } else { VECTORS };
        tangent.path = Path {
            freedom,
            is_whole,
            is_plain,
            held: mechanism.held.clone(),
            stride: 1,
            state,
            ..Path::default()
        };
        tangent.path.rate = tangent.fastest(until);
        tangent.path.covariance = vec![0.0; if is_whole { 4 * f * f } else { 1 }];
        let mut dice = Dice(1);
        tangent.path.columns = match is_whole {
            true => (0..2 * f).map(|j| unit(j, f, tangent.path.rate)).collect(),
            false => tangent.basis(count, &mut dice),
        };
        // The more directions there are, the less each of them must be known.
        tangent.path.order = match (is_exact || tangent.ground.is_some(), is_whole || freedom <= WHOLE) {
            (true, true) => beside::ORDERS[0],
            (true, false) | (false, true) => beside::ORDERS[1],
            (false, false) => beside::ORDERS[2],
        };
        tangent.path.inputs = tangent.changes(INPUTS[usize::from(!is_whole)], &mut dice);
        for column in tangent.path.columns.iter_mut().chain(&mut tangent.path.inputs) {
            column.resize(2 * f + tangent.set.len(), 0.0);
        }
        // Vectors stand for as many as there are directions.
        tangent.path.log = 0.5 * libm::log(2.0 * freedom as f64 / count as f64);
        tangent.make_room();
        tangent.normalise();
        tangent.path.growth = vec![[tangent.path.state.time.hi, tangent.path.log, f64::NEG_INFINITY]];
        tangent.path.step = 0.1 / tangent.path.rate;
        tangent.evaluate();
        tangent.prepare();
        Ok(tangent)
    }

    /// Without a path.
    pub(super) fn bare(mechanism: &Arc<Mechanism>) -> Result<Self, String> {
        if !mechanism.tree.is_dense() {
            return Err("a series takes the matrices of the tree, which are too large here".into());
        }
        let problem = tangent_form(mechanism);
        let metric = DistanceMetric::new(mechanism);
        let coordinates = problem.coordinates();
        let weights: Vec<f64> = match coordinates {
            Coordinates::Independent => {
                mechanism.partition.independent.iter().map(|&k| metric.weight(k)).collect()
            }
            _ => (0..mechanism.coordinates()).map(|k| metric.weight(k)).collect(),
        };
        if weights.is_empty() {
            return Err("nothing is free to move: neighbouring motions are the same".into());
        }
        let rates = vec![0.0; problem.dimension()];
        let ground = (coordinates == Coordinates::All && !mechanism.constraints.is_empty())
            .then(|| Ground::new(mechanism));
        let (set, mechanism) = (set_by_events(mechanism), Arc::clone(mechanism));
        Ok(Self {
            mechanism,
            problem,
            coordinates,
            weights,
            series: Vec::new(),
            gauss: TangentGauss::new(),
            ground,
            set,
            parameters: Vec::new(),
            seeds: Vec::new(),
            rates,
            jacobian: Vec::new(),
            column: Vec::new(),
            path: Path::default(),
        })
    }

    /// Goes on from a path; `None` where it cannot be one of this mechanism, in which all acts and is held as
    /// at the end of the path.
    pub(in crate::run::trust) fn resume(mechanism: &Arc<Mechanism>, path: Path) -> Option<Self> {
        if path.held != mechanism.held {
            return None;
        }
        let mut tangent = Self::bare(mechanism).ok()?;
        let (f, dimension) = (tangent.weights.len(), tangent.problem.dimension());
        let count = path.columns.len();
        let fits = path.state.y.len() == dimension
            && path.state.low.len() == dimension
            && count > 0
            && path
                .columns
                .iter()
                .chain(&path.inputs)
                .all(|column| column.len() == 2 * f + tangent.set.len())
            && (!path.is_whole || count == 2 * f && tangent.ground.is_none())
            && path.covariance.len() == if path.is_whole { 4 * f * f } else { 1 }
            && path.nodes.len() < gauss::STAGES * 2 * f * f
            && path.nodes.len().is_multiple_of(2 * f * f)
            && beside::ORDERS.contains(&path.order)
            && (!path.is_plain || path.is_whole && path.step > 0.0)
            && path.stride > 0
            && !path.growth.is_empty();
        if !fits {
            return None;
        }
        tangent.path = path;
        tangent.hold_engaged();
        tangent.make_room();
        tangent.take_parameters().ok()?;
        tangent.evaluate();
        if tangent.path.lost.is_none() {
            tangent.prepare();
        }
        Some(tangent)
    }
}
