//! The mechanism in motion: which part of the run, how fast, and its frames.

use super::Finished;
use crate::chart::{MotionGif, plain};
use crate::report::curves::{between, furthest, is_coarse};
use crate::run::Sample;
use std::f64::consts::TAU;

/// Frames of an animation nobody chose the window of, and the most of one somebody did.
const FRAMES: usize = 250;
const MOST: usize = 1500;
/// How long a frame stays \[1/100 s\].
const DELAY: u16 = 4;
/// How far the fastest body may turn in an animation that is neither slowed down nor sped up \[rad\].
const LIVELY: [f64; 2] = [0.5, 20.0 * TAU];
/// Points of a path between two frames.
const FINE: usize = 4;

impl Finished<'_> {
    /// The window asked for, else the first seconds in their own time; faster or slower where too much or
    /// nothing would be seen.
    pub fn motion(&self) -> MotionGif {
        let trace = &self.outcome.trace;
        if trace.window.is_some() { self.chosen(&trace.part) } else { self.beginning(&trace.head) }
    }

    fn beginning(&self, head: &[Sample]) -> MotionGif {
        let shown = FRAMES as f64 * f64::from(DELAY) / 100.0;
        let all = head.last().map_or(0.0, |last| last.t);
        let turned_by = |until: f64| {
            let pairs = head.windows(2).take_while(|pair| pair[1].t <= until * (1.0 + 1e-12));
            pairs.map(|pair| furthest(&pair[0], &pair[1])).sum::<f64>()
        };
        let mut until = all.min(shown);
        let turned = turned_by(until);
        if turned > LIVELY[1] {
            until *= LIVELY[1] / turned;
        } else if turned < LIVELY[0] {
            until = all;
        }
        let frames = if until < shown && turned <= LIVELY[1] {
            (until / shown * FRAMES as f64).ceil() as usize
        } else {
            FRAMES
        };
        self.frames(head, [0.0, until], frames.max(1))
    }

    /// A window in its own time, as far as there are frames for it; where its rows are too far apart for
    /// anything between them to be known, a frame each and no paths.
    fn chosen(&self, part: &[Sample]) -> MotionGif {
        let [from, to] = [part.first(), part.last()].map(|end| end.map_or(0.0, |sample| sample.t));
        if !is_coarse(&part.iter().collect::<Vec<_>>()) {
            let frames = (100.0 * (to - from) / f64::from(DELAY)).clamp(FRAMES as f64 / 5.0, MOST as f64);
            return self.frames(part, [from, to], frames.ceil() as usize);
        }
        MotionGif {
            poses: part.iter().map(|sample| self.drawing().pose(&sample.phi, &sample.omega)).collect(),
            time: part.iter().map(|sample| sample.t).collect(),
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
