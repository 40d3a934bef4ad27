//! A run in pictures: which charts it has, and what they show.

mod columns;
mod drift;
mod motion;
mod outputs;

pub use columns::RowColumns;
pub use drift::{drifts, overlay};

use crate::chart::{
    self, AngleSeries, Angles, ChartError, FILE_RESOLUTION, MechanismChart, MotionGif, Picture, Pose, plain,
};
use crate::dynamics::Mechanism;
use crate::dynamics::forest::BodyOrigin;
use crate::report::curves::{STILL, furthest, is_coarse, smoothed, span, turned};
use crate::report::drawing::MechanismDrawing;
use crate::report::page::{figure, rough};
use crate::run::{Outcome, Sample};
use crate::scene::{Place, Scene};
use std::f64::consts::TAU;

/// A chart of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chart {
    /// The mechanism at the end, and the way there.
    Mechanism,
    /// Angles against time.
    Angles,
    /// Energy drift against time.
    EnergyDrift,
    /// Constraint drift against time.
    ConstraintDrift,
    /// Torque and power of the motors against time.
    TorquePower,
    /// Outputs against time.
    Outputs,
}

impl Chart {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Mechanism,
        Self::Angles,
        Self::EnergyDrift,
        Self::ConstraintDrift,
        Self::TorquePower,
        Self::Outputs,
    ];

    /// Name of its file, without the ending.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mechanism => "mechanism",
            Self::Angles => "angles",
            Self::EnergyDrift => "energy_drift",
            Self::ConstraintDrift => "constraint_drift",
            Self::TorquePower => "torque_power",
            Self::Outputs => "outputs",
        }
    }
}

/// The charts a run has something to show in: none of angles and positions where nothing moves, none of
/// constraints that are kept exactly, none of torques without motors, and none against time of a single row.
pub fn wanted(mechanism: &Mechanism, outcome: &Outcome) -> Vec<Chart> {
    let trace = &outcome.trace;
    let rows = if trace.window.is_some() { trace.part.len() } else { trace.whole.len() };
    let has = |chart: &Chart| match chart {
        Chart::Mechanism => true,
        _ if rows < 2 => false,
        Chart::EnergyDrift => true,
        Chart::Angles => moves(mechanism, outcome),
        Chart::ConstraintDrift => drifts(&[outcome]),
        Chart::TorquePower => !motors(mechanism, outcome).is_empty(),
        Chart::Outputs => mechanism.outputs.is_some(),
    };
    Chart::ALL.into_iter().filter(has).collect()
}

/// The rows of motors, of those that events switch or that hold still as well, and of gears that have done
/// work.
fn motors(mechanism: &Mechanism, outcome: &Outcome) -> Vec<usize> {
    let (all, trace) = (mechanism.with_all_parts(), &outcome.trace);
    let samples = || trace.whole.iter().chain(&trace.head).chain(&trace.part);
    let works = |row: usize| {
        // Torque of a motor, power of a gear.
        let what = usize::from(all.constraints[row].law.is_none());
        all.is_motor(row) && samples().any(|sample| sample.motors[row][what] != 0.0)
    };
    (0..all.constraints.len()).filter(|&row| all.constraints[row].is_motor() || works(row)).collect()
}

/// Whether any coordinate of the scene's own bodies changes.
fn moves(mechanism: &Mechanism, outcome: &Outcome) -> bool {
    let trace = &outcome.trace;
    let all = || trace.whole.iter().chain(&trace.head).chain(&trace.part);
    let spread = |k: usize| {
        let values = || all().map(|sample| sample.phi[k]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    let own = 0..mechanism.own_bodies().len();
    own.chain(mechanism.bodies.len()..mechanism.coordinates()).any(|k| spread(k) > STILL)
}

/// Draws one chart.
///
/// # Errors
/// Drawing fails.
pub fn draw(
    chart: Chart,
    scene: &Scene,
    mechanism: &Mechanism,
    outcome: &Outcome,
) -> Result<Picture, ChartError> {
    let run = Finished { scene, mechanism, outcome };
    match chart {
        Chart::Mechanism => chart::mechanism(&run.mechanism_chart(), FILE_RESOLUTION),
        Chart::Angles => chart::angles(&run.angles(), FILE_RESOLUTION),
        Chart::EnergyDrift => chart::energy_drift(&run.energy_drift(), FILE_RESOLUTION),
        Chart::ConstraintDrift => chart::constraint_drift(&run.constraint_drift(), FILE_RESOLUTION),
        Chart::TorquePower => chart::torque_power(&run.torque_power(), FILE_RESOLUTION),
        Chart::Outputs => chart::outputs(&run.outputs(), FILE_RESOLUTION),
    }
}

/// Draws columns of the trajectory.
///
/// # Errors
/// Drawing fails.
pub fn columns(
    scene: &Scene,
    mechanism: &Mechanism,
    outcome: &Outcome,
    columns: &RowColumns,
) -> Result<Picture, ChartError> {
    chart::outputs(&Finished { scene, mechanism, outcome }.columns(columns), FILE_RESOLUTION)
}

/// The mechanism in motion.
pub fn motion(scene: &Scene, mechanism: &Mechanism, outcome: &Outcome) -> MotionGif {
    Finished { scene, mechanism, outcome }.motion()
}

/// Most it may turn in a window of time that shows single swings \[rad\], and how much is shown instead.
const CROWDED: [f64; 2] = [40.0 * TAU, 12.0 * TAU];
/// Rows of a window, too far apart for curves, of which fewer are not shown alone: those of the run are.
const ROWS: usize = 12;
/// How far the fastest body turns along the path shown \[rad\].
const PATH: f64 = 4.0 * TAU;
/// What captions say of rows between which a body turns too far.
const ALIAS: &str = "too far apart for curves: a slow pattern of them may be an alias";
/// How far it turns between ghosts \[rad\].
const GHOST: f64 = 0.4;
/// Ghosts shown.
const GHOSTS: usize = 5;
/// Samples from which on a path ends where a body has moved by as many metres, too.
const MOVED: usize = 100;

/// `last 3 s of 10 s`; `all 10 s` where both are the same to three digits.
fn part_of(which: &str, part: f64, whole: f64) -> String {
    if part >= whole || rough(part) == rough(whole) {
        return format!("all {} s", figure(whole));
    }
    format!("{which} {} s of {} s", rough(part), figure(whole))
}

/// A run and all that belongs to it.
struct Finished<'a> {
    scene: &'a Scene,
    mechanism: &'a Mechanism,
    outcome: &'a Outcome,
}

impl Finished<'_> {
    fn drawing(&self) -> MechanismDrawing<'_> {
        MechanismDrawing { scene: self.scene, mechanism: self.mechanism }
    }

    fn caption(&self, more: Option<String>) -> Vec<String> {
        let plan = &self.outcome.plan;
        let mut caption =
            vec![format!("scene {}", plain(&self.scene.name)), plain(&crate::report::setting(plan))];
        if !self.mechanism.constraints.is_empty() {
            caption.push(plain(&crate::report::check::stabilization(self.mechanism, plan)));
        }
        caption.extend(more);
        caption
    }

    /// The time up to which the path can be trusted \[s\], where that ends before `end`; and what to say
    /// about it.
    fn horizon(&self, end: f64) -> (Option<f64>, Option<String>) {
        let horizon =
            self.outcome.trust.as_ref().and_then(|trust| trust.horizon).filter(|&horizon| horizon < end);
        (horizon, horizon.map(|horizon| format!("pale beyond the trust horizon, {} s", rough(horizon))))
    }

    /// Samples in which single swings can be told apart: of the whole run, or else of its beginning; and what
    /// to say about it.
    fn window(&self) -> (Vec<&Sample>, Option<String>) {
        let trace = &self.outcome.trace;
        if trace.window.is_some() {
            return (trace.part.iter().collect(), Some(self.chosen_window()));
        }
        let whole: Vec<&Sample> = trace.whole.iter().collect();
        if !is_coarse(&whole, self.angle_count())
            && whole.windows(2).map(|pair| furthest(pair[0], pair[1])).sum::<f64>() <= CROWDED[0]
        {
            return (whole, None);
        }
        let mut turned = 0.0;
        let mut window: Vec<&Sample> = Vec::new();
        for sample in &trace.head {
            turned += window.last().map_or(0.0, |before| furthest(before, sample));
            if turned > CROWDED[1] && window.len() > 1 {
                break;
            }
            window.push(sample);
        }
        if window.len() < ROWS && is_coarse(&window, self.angle_count()) {
            return (whole, None);
        }
        let said = part_of("first", span(&window), self.outcome.last.t);
        (window, Some(said))
    }

    /// `10 s to 12 s of 500 s`.
    fn chosen_window(&self) -> String {
        let ([from, to], end) = (self.outcome.trace.window.unwrap_or_default(), self.outcome.last.t);
        format!("{} s to {} s of {} s", figure(from.max(0.0)), figure(to.min(end)), figure(end))
    }

    /// All samples of the window asked for, or the last ones, as far back as the fastest body turns by
    /// `PATH`; where none of these can be trusted, the last ones that can.  And what to say about it.
    fn path(&self) -> (Vec<&Sample>, Option<String>) {
        let trace = &self.outcome.trace;
        if trace.window.is_some() {
            return (trace.part.iter().collect(), Some(self.chosen_window()));
        }
        let whole = self.outcome.last.t;
        let last = self.last_stretch(trace.tail.iter());
        let begin = last.first().map_or(0.0, |sample| sample.t);
        if let Some(horizon) = self.horizon(begin).0 {
            let trusted = self.before(horizon);
            let near = self.last_stretch(trace.head.iter().filter(|sample| sample.t < horizon));
            // Rows that are too far apart have no path, and those of the beginning may have one.
            if is_coarse(&trusted, self.angle_count()) && !is_coarse(&near, self.angle_count()) {
                let (span, end) = (rough(span(&near)), near.last().map_or(0.0, |last| last.t));
                return (
                    near,
                    Some(format!("{span} s up to {} s of {} s, trusted", rough(end), figure(whole))),
                );
            }
            let span = rough(span(&trusted));
            return (
                trusted,
                Some(format!(
                    "{span} s before the trust horizon, {} s of {} s",
                    rough(horizon),
                    figure(whole)
                )),
            );
        }
        let shown = if begin > 0.0 { span(&last) } else { whole };
        (last, Some(part_of("last", shown, whole)))
    }

    /// How many of the coordinates are angles.
    fn angle_count(&self) -> usize {
        self.mechanism.bodies.len()
    }

    /// The last of some samples, as far back as the fastest body turns by `PATH`.
    fn last_stretch<'a>(&self, samples: impl DoubleEndedIterator<Item = &'a Sample>) -> Vec<&'a Sample> {
        let (mut by_angle, mut by_any) = (0.0, 0.0);
        let mut path: Vec<&Sample> = Vec::new();
        for sample in samples.rev() {
            if let Some(after) = path.last() {
                by_angle += turned(sample, after, self.angle_count());
                by_any += furthest(sample, after);
            }
            // Two rows tell whether they are too far apart for a path.
            if path.len() > 1 && (by_angle > PATH || by_any > PATH && path.len() >= MOVED) {
                break;
            }
            path.push(sample);
        }
        path.reverse();
        path
    }

    /// The last samples up to a time, of those that lie closest together there.
    fn before(&self, horizon: f64) -> Vec<&Sample> {
        let trace = &self.outcome.trace;
        let is_known = |sample: &&Sample| sample.t <= horizon;
        if trace.tail.front().is_some_and(|first| first.t < horizon) {
            self.last_stretch(trace.tail.iter().filter(is_known))
        } else if trace.head.last().is_some_and(|last| last.t >= horizon) {
            self.last_stretch(trace.head.iter().filter(is_known))
        } else {
            self.last_stretch(trace.whole.iter().filter(is_known))
        }
    }

    fn mechanism_chart(&self) -> MechanismChart {
        let (path, more) = self.path();
        let coarse = is_coarse(&path, self.angle_count());
        let drawing = self.drawing();
        let traced = drawing.traced();
        let trails = if coarse {
            Vec::new()
        } else {
            let smooth = smoothed(&path);
            let trail = |place: &Place| smooth.iter().map(|(_, phi)| drawing.place(place, phi)).collect();
            traced.iter().map(trail).collect()
        };
        let mut poses: Vec<Pose> = Vec::new();
        let (mut turned, mut after) = (0.0, None);
        for sample in path.iter().rev() {
            turned += after.map_or(GHOST, |after| furthest(sample, after));
            after = Some(*sample);
            if turned >= GHOST && poses.len() <= GHOSTS {
                poses.push(self.drawing().pose(&sample.phi, &sample.omega));
                turned = 0.0;
            }
        }
        poses.reverse();
        if coarse {
            poses.drain(..poses.len().saturating_sub(1));
        }
        let end = path.last().map_or(self.outcome.last.t, |sample| sample.t);
        let title = (drawing.title().filter(|_| !coarse && moves(self.mechanism, self.outcome)))
            .unwrap_or_else(|| format!("The mechanism at {} s", figure(end)));
        let more = more.filter(|_| !coarse || self.outcome.trace.window.is_some());
        let (horizon, past) = self.horizon(end);
        let trusted = horizon
            .filter(|_| !coarse)
            .map(|horizon| smoothed(&path).partition_point(|(t, _)| *t <= horizon));
        let mut caption = self.caption(more);
        caption.extend(past);
        caption.extend(coarse.then(|| "no path, as rows are too far apart for one".to_owned()));
        MechanismChart {
            title,
            caption,
            sketch: self.drawing().sketch(),
            poses,
            names: if coarse { Vec::new() } else { drawing.names() },
            trails,
            horizon: trusted,
        }
    }

    fn angles(&self) -> Angles {
        let (window, more) = self.window();
        let is_coarse = is_coarse(&window, self.angle_count());
        let smooth = match is_coarse {
            true => window.iter().map(|sample| (sample.t, sample.phi.clone())).collect(),
            false => smoothed(&window),
        };
        let series = self.mechanism.own_bodies().iter().enumerate().map(|(k, body)| AngleSeries {
            name: plain(&body.name),
            angle: smooth.iter().map(|(_, phi)| phi[k]).collect(),
        });
        let (moving, still): (Vec<_>, Vec<_>) = series.partition(|series| series.spread() > STILL);
        let drawing = self.drawing();
        let travels = self.scene.sliders.iter().map(|slider| AngleSeries {
            name: plain(&slider.name),
            angle: smooth.iter().map(|(_, phi)| drawing.travel(slider, phi)).collect(),
        });
        let (horizon, past) = self.horizon(window.last().map_or(0.0, |sample| sample.t));
        let mut caption = self.caption(more);
        caption.extend(past);
        caption.extend(is_coarse.then(|| format!("rows alone, {ALIAS}")));
        let travels: Vec<AngleSeries> = travels.collect();
        let positions = if travels.is_empty() { self.positions(&smooth) } else { Vec::new() };
        // A body that keeps its angle is told in a line where others move.
        let series = if moving.is_empty() && travels.is_empty() && positions.is_empty() {
            still
        } else {
            let names: Vec<&str> = still.iter().map(|series| series.name.as_str()).collect();
            caption.extend((!names.is_empty()).then(|| format!("at a constant angle: {}", names.join(", "))));
            moving
        };
        let title = match (series.is_empty(), travels.is_empty(), positions.is_empty()) {
            (true, false, _) => "Travel of the sliders",
            (false, false, _) => "Angles of the bars, travel of the sliders",
            (true, _, false) => "Positions of the bars",
            (false, _, false) => "Angles and positions of the bars",
            _ => "Angles of the bars",
        };
        Angles {
            title: title.to_owned(),
            caption,
            time: smooth.iter().map(|(t, _)| *t).collect(),
            is_coarse,
            series,
            travels,
            positions,
            horizon,
        }
    }

    /// The origins of bodies on floating bases, those that move.
    fn positions(&self, smooth: &[(f64, Vec<f64>)]) -> Vec<AngleSeries> {
        let own = 0..self.mechanism.own_bodies().len();
        let floating = own.filter_map(|body| match self.mechanism.forest.hangs[body].origin_point {
            BodyOrigin::Free(x) => Some((body, x)),
            _ => None,
        });
        let both = floating.flat_map(|(body, x)| {
            ["x", "y"].into_iter().zip([x, x + 1]).map(move |(axis, k)| (body, axis, k))
        });
        both.map(|(body, axis, k)| AngleSeries {
            name: format!("{}.{axis}", plain(&self.mechanism.bodies[body].name)),
            angle: smooth.iter().map(|(_, phi)| phi[k]).collect(),
        })
        .filter(|series| series.spread() > STILL)
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::part_of;

    #[test]
    fn a_part_is_not_told_as_long_as_the_whole() {
        assert_eq!(part_of("last", 3.0, 10.0), "last 3 s of 10 s");
        assert_eq!(part_of("first", 10.0, 10.0), "all 10 s");
        assert_eq!(part_of("last", 29.98, 30.0), "all 30 s");
        assert_eq!(part_of("first", 9.9, 10.0), "first 9.9 s of 10 s");
    }
}
