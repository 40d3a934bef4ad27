//! The mechanism in motion: which part of the run, how fast, and its frames.

use super::Finished;
use crate::chart::{MotionGif, plain};
use crate::report::curves::{between, furthest, is_coarse};
use crate::run::Sample;
use std::f64::consts::TAU;

/// Frames of an animation nobody chose the window of, and the most of one somebody did.
const FRAMES: usize = 250;
const MOST: usize = 1500;
/// Frames of the shortest animation.
const LEAST: usize = 50;
/// How long a frame stays \[1/100 s\], and how long at most where every row has one.
const DELAY: u16 = 4;
const LONGEST: u16 = 100;
/// How far the fastest body may turn in an animation that is neither slowed down nor sped up \[rad\].
const LIVELY: [f64; 2] = [0.5, 20.0 * TAU];
/// Points of a path between two frames.
const FINE: usize = 4;

impl Finished<'_> {
    /// The window asked for, else the first seconds in their own time; faster or slower where too much or
    /// nothing would be seen.  Where rows are too far apart for anything between them to be known, a frame
    /// each and no paths.
    pub fn motion(&self) -> MotionGif {
        let trace = &self.outcome.trace;
        let (samples, most) = match trace.window {
            Some(_) => (&trace.part, MOST),
            None => (&trace.head, FRAMES),
        };
        if is_coarse(&samples.iter().collect::<Vec<_>>(), self.angle_count()) {
            self.rows(&samples[..samples.len().min(most)])
        } else if trace.window.is_some() {
            self.chosen(samples)
        } else {
            self.beginning(samples)
        }
    }

    fn beginning(&self, head: &[Sample]) -> MotionGif {
        let shown = FRAMES as f64 * f64::from(DELAY) / 100.0;
        let all = head.last().map_or(0.0, |last| last.t);
        let mut until = all.min(shown);
        let turned = turned_by(head, until);
        if turned > LIVELY[1] {
            until *= LIVELY[1] / turned;
        } else if turned < LIVELY[0] {
            until = all;
        }
        let frames = if until < shown && turned <= LIVELY[1] {
            enough(until, turned).clamp(LEAST, FRAMES)
        } else {
            FRAMES
        };
        self.frames(head, [0.0, until], frames)
    }

    /// A window in its own time, as far as there are frames for it.
    fn chosen(&self, part: &[Sample]) -> MotionGif {
        let [from, to] = [part.first(), part.last()].map(|end| end.map_or(0.0, |sample| sample.t));
        let frames = enough(to - from, turned_by(part, to)).clamp(LEAST, MOST);
        self.frames(part, [from, to], frames)
    }

    /// A frame for each row, in their own time as far as that can be watched.
    fn rows(&self, rows: &[Sample]) -> MotionGif {
        let [from, to] = [rows.first(), rows.last()].map(|end| end.map_or(0.0, |sample| sample.t));
        let apart = (to - from) / (rows.len().max(2) - 1) as f64;
        let most = (MOST * usize::from(DELAY) / rows.len().max(1)) as f64;
        let delay = (100.0 * apart).min(most).clamp(f64::from(DELAY), f64::from(LONGEST));
        MotionGif {
            poses: rows.iter().map(|sample| self.drawing().pose(&sample.phi, &sample.omega)).collect(),
            time: rows.iter().map(|sample| sample.t).collect(),
            delay: delay.round() as u16,
            ..self.still(to)
        }
    }

    /// One frame more than so many, at equal intervals.
    fn frames(&self, samples: &[Sample], [from, to]: [f64; 2], frames: usize) -> MotionGif {
        let at = |k: usize, count: usize| between(samples, from + (to - from) * k as f64 / count as f64);
        let drawing = self.drawing();
        let trails = drawing.traced().into_iter().map(|place| {
            (0..=FINE * frames).map(|k| drawing.place(&place, &at(k, FINE * frames).0)).collect()
        });
        let poses = (0..=frames).map(|k| {
            let (phi, omega) = at(k, frames);
            drawing.pose(&phi, &omega)
        });
        MotionGif {
            poses: poses.collect(),
            trails: trails.collect(),
            time: (0..=frames).map(|k| from + (to - from) * k as f64 / frames as f64).collect(),
            ..self.still(to)
        }
    }

    /// What does not depend on the frames.
    fn still(&self, to: f64) -> MotionGif {
        MotionGif {
            title: plain(&self.scene.name),
            sketch: self.drawing().sketch(),
            delay: DELAY,
            horizon: self.horizon(to).0,
            ..MotionGif::default()
        }
    }
}

/// How far the fastest body turns up to a time \[rad\].
fn turned_by(samples: &[Sample], until: f64) -> f64 {
    let pairs = samples.windows(2).take_while(|pair| pair[1].t <= until * (1.0 + 1e-12));
    pairs.map(|pair| furthest(&pair[0], &pair[1])).sum()
}

/// Frames for a span of time in its own time, or as slowly as the eye can follow.
fn enough(span: f64, turned: f64) -> usize {
    let [in_time, lively] = [100.0 * span / f64::from(DELAY), FRAMES as f64 * turned / LIVELY[1]];
    in_time.max(lively).ceil() as usize
}
