//! Positions, velocities, accelerations and loads of a mechanism that a drive moves through its range, found
//! without integrating: at every value of the drive the constraints are solved.
//!
//! ```text
//! C(q, t) = 0,   drive(q) = start + rate t                  by projection from q + q' h + q'' h²/2
//! G q' = -C_t,   G q'' = -(C_t)' - G' q'
//!     multipliers, and with them forces, from the same solve
//! limit:         q' without bound, 1/q'² -> 0 in proportion to what is left of the drive's range
//! dead centre:   the rate of another body, or of a slider's travel, passes zero
//! change point:  det G changes its sign: two ways of motion cross,
//!     and the one that goes straight on is taken
//! ```
//!
//! Source: E. J. Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), sections 3.6
//! and
//! 3.7; the law at a limit is that of a fold, q - q* ~ |t - t*|^(1/2).

mod drive;
mod extremes;
mod independence;
mod transmission;
mod travel;
mod walk;

pub(super) use drive::left_out;
pub use drive::{KinematicDrive, KinematicsError};
pub use transmission::Transmission;

use crate::dynamics::Mechanism;
use crate::scene::Scene;
use drive::DrivenScene;
use extremes::SolvedRange;
use serde::Serialize;
use std::sync::Arc;
use travel::SliderTravel;
use walk::{DriveWalk, IN_LINE, LimitApproach, SolvedPosition, between};

/// Relative width at which a searched time is taken for found.
const FOUND: f64 = 1e-13;
/// A rate below this share of the largest one stands still all along.
const STILL: f64 = 1e-11;
/// Guesses from which other assemblies are looked for.
const ATTEMPTS: usize = 96;

/// What there is to know of one value of the drive.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Position {
    /// The drive's angle \[rad\] or travel \[m\].
    pub drive: f64,
    /// Time at the drive's rate, zero at the scene's start \[s\].
    pub t: f64,
    /// Winding angles \[rad\], then translational coordinates \[m\].
    pub phi: Vec<f64>,
    /// Rates \[rad/s, m/s\].
    pub omega: Vec<f64>,
    /// Accelerations \[rad/s², m/s²\]; at a change point these, forces and outputs made of either are NaN.
    pub alpha: Vec<f64>,
    /// Torque \[N·m\] or force \[N\] of the drive.
    pub force: f64,
    /// Transmission angles in their order \[rad\].
    pub transmission: Vec<f64>,
    /// Values of the scene's outputs, in their order.
    pub outputs: Vec<f64>,
}

impl Position {
    /// A column of what is over the drive: its force, then outputs, then transmission angles.
    pub(crate) fn column(&self, column: usize) -> f64 {
        match column.checked_sub(1) {
            None => self.force,
            Some(k) if k < self.outputs.len() => self.outputs[k],
            Some(k) => self.transmission[k - self.outputs.len()],
        }
    }
}

/// An end of the drive's range.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// The drive's value there \[rad or m\].
    pub drive: f64,
    /// Hinges at which two bodies stand in line there.
    pub in_line: Vec<String>,
    /// True where rates grow without bound as at a fold; else the way on was lost for another reason.
    pub is_fold: bool,
}

/// A value of the drive at which another body turns back.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeadCentre {
    /// The drive's value \[rad or m\].
    pub drive: f64,
    /// The body, coordinate or slider.
    pub name: String,
    /// Its angle \[rad\], travel or place \[m\] there: the end of its own range.
    pub value: f64,
    /// Hinges at which two bodies stand in line there.
    pub in_line: Vec<String>,
}

/// Least and largest value of a column over the range, with the drive's values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Range {
    /// Name of the output or the transmission angle.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Least value, and where; infinite where it falls without bound towards a limit or a change point, and
    /// that; NaN where its limit at a change point is not known.
    pub min: [f64; 2],
    /// Largest value, in the same way.
    pub max: [f64; 2],
}

/// A mechanism moved through the range of its drive.
#[derive(Clone, Debug)]
pub struct Kinematics {
    /// The scene with the drive.
    pub scene: Scene,
    /// Its mechanism.
    pub mechanism: Arc<Mechanism>,
    /// Name of the drive.
    pub drive: String,
    /// Name of the motor that moves it, and of its column.
    pub motor: String,
    /// Its unit: `rad` or `m`.
    pub unit: &'static str,
    /// Its rate \[rad/s or m/s\].
    pub rate: f64,
    /// True where it goes round once.
    pub is_turn: bool,
    /// True where after one turn everything is where it was.
    pub is_closed: bool,
    /// The positions, in ascending order of the drive.
    pub positions: Vec<Position>,
    /// Ends of the range that were met within what was asked for.
    pub limits: Vec<Limit>,
    /// Where other bodies turn back.
    pub dead_centres: Vec<DeadCentre>,
    /// Values of the drive at which ways of motion cross.
    pub change_points: Vec<f64>,
    /// The transmission angles.
    pub transmissions: Vec<Transmission>,
    /// Extremes of the drive's force, the outputs and the transmission angles.
    pub ranges: Vec<Range>,
    /// Angles and positions of other assemblies at the drive's value at the start.
    pub branches: Vec<Vec<f64>>,
    /// What of the scene has no part in this.
    pub left_out: Vec<&'static str>,
}

/// Moves a scene through the range of its drive, in `count` positions at equal distances and one more at the
/// end.
///
/// # Errors
/// There is nothing to drive, or more moves than the drive gives; the scene with the drive does not compile.
pub fn kinematics(
    scene: &Scene,
    drive: &KinematicDrive,
    count: usize,
) -> Result<Kinematics, KinematicsError> {
    let DrivenScene { scene, mechanism, start, row, name, label, unit, rate, range, is_turn } =
        DrivenScene::new(scene, drive)?;
    let transmissions = transmission::of(&scene, &name);
    let lines = transmission::lines(&scene);
    let walk = DriveWalk::at_start(&mechanism, &scene, row, [start, rate], [&transmissions, &lines])?;
    let count = count.max(1);
    let value = |k: usize| range[0] + (range[1] - range[0]) * (k as f64 / count as f64);
    let time = |value: f64| (value - start) / rate;
    // The positions on either side of the start, each from there outwards.
    let is_asked = |drive: f64| range[0] <= drive && drive <= range[1];
    let mut limits = Vec::new();
    let mut sides: [Vec<SolvedPosition>; 2] = Default::default();
    let mut approaches: [Option<LimitApproach>; 2] = Default::default();
    let mut here = walk.clone();
    for ((side, approach), is_below) in sides.iter_mut().zip(&mut approaches).zip([true, false]) {
        let mut values: Vec<f64> = (0..=count).map(value).filter(|v| (*v < start) == is_below).collect();
        if is_below {
            values.reverse();
        }
        here.clone_from(&walk);
        for value in values {
            match here.go(time(value)) {
                Ok(()) => side.push(here.solved()),
                Err(limit) => {
                    let last = side.last().cloned().unwrap_or_else(|| walk.solved());
                    let way = is_asked(limit.drive).then(|| here.approach(&last, &limit));
                    *approach = way.map(|way| way.within(is_asked));
                    limits.push(limit);
                    break;
                }
            }
        }
    }
    let mut all = SolvedRange::new(sides, approaches);
    let rows = &all.positions[all.rows.clone()];
    let mut found = Kinematics {
        branches: mechanism.other_assemblies(&scene, ATTEMPTS, 1.0).0,
        left_out: left_out(&scene),
        is_closed: is_turn && rows.first().zip(rows.last()).is_some_and(|(a, b)| a.is_as(b, &mechanism)),
        dead_centres: Vec::new(),
        change_points: Vec::new(),
        ranges: Vec::new(),
        positions: rows.iter().map(|one| one.position.clone()).collect(),
        drive: label,
        motor: name,
        scene,
        mechanism,
        unit,
        rate,
        is_turn,
        limits,
        transmissions,
    };
    found.search(&mut all, &mut here);
    Ok(found)
}

impl Kinematics {
    /// Looks between positions, and up to limits, for dead centres, change points and extremes.
    fn search(&mut self, range: &mut SolvedRange, walk: &mut DriveWalk) {
        let all = &range.positions[..];
        let coordinates = self.mechanism.coordinates();
        let own = self.mechanism.own_bodies().len();
        let shown: Vec<usize> = (0..own).chain(self.mechanism.bodies.len()..coordinates).collect();
        let rows = &all[range.rows.clone()];
        let fastest = |k: usize| rows.iter().map(|one| one.position.omega[k].abs()).fold(0.0, f64::max);
        let most = shown.iter().map(|&k| fastest(k)).fold(0.0, f64::max);
        let moving: Vec<usize> = shown.into_iter().filter(|&k| fastest(k) > STILL * most).collect();
        for k in moving {
            let rates: Vec<f64> = all.iter().map(|one| one.position.omega[k]).collect();
            let value = |_: &DriveWalk, found: &Position| found.phi[k];
            self.turn_back(&self.name(k), (all, &rates), walk, (|walk: &DriveWalk| walk.omega(k), value));
        }
        for travel in SliderTravel::of(&self.scene, &self.mechanism) {
            let rates = travel.rates(all, walk);
            let fastest = rates[range.rows.clone()].iter().fold(0.0, |most: f64, rate| most.max(rate.abs()));
            if fastest <= STILL * most * self.mechanism.units.length {
                continue;
            }
            // At a position that is a dead centre the rate is zero to rounding, with either sign.
            let plain = |rate: f64| if rate.abs() <= STILL * fastest { 0.0 } else { rate };
            let rates: Vec<f64> = rates.into_iter().map(plain).collect();
            let rate = |walk: &DriveWalk| plain(travel.rate(walk));
            let value = |walk: &DriveWalk, _: &Position| travel.value(walk);
            self.turn_back(&travel.name, (all, &rates), walk, (rate, value));
        }
        self.dead_centres.sort_by(|a, b| a.drive.total_cmp(&b.drive));
        self.find_change_points(range, walk);
        self.extremes(range, walk);
    }

    /// Finds where ways of motion cross, and what columns come to there; positions just there have neither
    /// forces nor accelerations.
    fn find_change_points(&mut self, range: &mut SolvedRange, walk: &mut DriveWalk) {
        let all = &range.positions[..];
        let mut found = Vec::new();
        for [before, after] in all.windows(2).filter_map(|pair| <&[SolvedPosition; 2]>::try_from(pair).ok()) {
            if before.orientation.zip(after.orientation).is_some_and(|(before, after)| before * after < 0.0) {
                let sign = |walk: &DriveWalk| walk.orientation().unwrap_or(0.0);
                found.extend(walk.root([before, after], sign).map(|_| walk.solved()));
            }
        }
        found.extend(walk.more_singular(range, &found));
        found.sort_by(|a, b| a.position.drive.total_cmp(&b.position.drive));
        self.change_points = found.iter().map(|at| at.position.drive).collect();
        let parts = found.iter().zip(between(all, &found));
        let singular: Vec<_> = parts.map(|(at, ends)| walk.beside_singular(all, at, ends)).collect();
        for (position, solved) in self.positions.iter_mut().zip(&all[range.rows.clone()]) {
            if singular.iter().any(|one| one.hides(solved)) {
                position.alpha.fill(f64::NAN);
                position.force = f64::NAN;
                if let Some(outputs) = &self.mechanism.outputs {
                    outputs.withhold(&mut position.outputs);
                }
            }
        }
        range.singular = singular;
    }

    /// Finds where something turns back between positions, at which it has these rates, and at the last of
    /// them, by its rate and its value.
    fn turn_back(
        &mut self,
        name: &str,
        (all, rates): (&[SolvedPosition], &[f64]),
        walk: &mut DriveWalk,
        (rate, value): (impl Fn(&DriveWalk) -> f64, impl Fn(&DriveWalk, &Position) -> f64),
    ) {
        for (pair, rates) in all.windows(2).zip(rates.windows(2)) {
            if (rates[0] * rates[1] < 0.0 || rates[1] == 0.0)
                && let Some(found) = walk.root([&pair[0], &pair[1]], &rate)
            {
                self.dead_centres.push(DeadCentre {
                    drive: found.drive,
                    name: name.to_owned(),
                    value: value(walk, &found),
                    in_line: walk.in_line(IN_LINE),
                });
            }
        }
    }

    /// Looks for the extremes of all columns.
    fn extremes(&mut self, range: &SolvedRange, walk: &mut DriveWalk) {
        let outputs = self.mechanism.outputs.clone();
        let heads: Vec<(String, String)> =
            std::iter::once((self.name_of_force(), self.unit_of_force().to_owned()))
                .chain(outputs.iter().flat_map(|outputs| {
                    outputs.heads().map(|(name, unit)| (name.to_owned(), unit.to_owned())).collect::<Vec<_>>()
                }))
                .chain(self.transmissions.iter().map(|one| (one.name(), "rad".to_owned())))
                .collect();
        self.ranges = heads
            .into_iter()
            .enumerate()
            .filter_map(|(column, (name, unit))| {
                let [min, max] = [1.0, -1.0].map(|sign| walk.least(range, column, sign));
                let (min, max) = (min?, max?);
                Some(Range { name, unit, min, max: [-max[0], max[1]] })
            })
            .collect();
    }

    /// Name of a coordinate: the body, or what slides.
    fn name(&self, k: usize) -> String {
        self.mechanism
            .bodies
            .get(k)
            .map_or_else(|| self.mechanism.coordinate_name(k), |body| body.name.clone())
    }

    /// Name of the column of the drive's force.
    pub fn name_of_force(&self) -> String {
        format!("{}.{}", self.motor, if self.unit == "rad" { "torque" } else { "force" })
    }

    /// `N m` or `N`.
    pub fn unit_of_force(&self) -> &'static str {
        if self.unit == "rad" { "N m" } else { "N" }
    }
}
