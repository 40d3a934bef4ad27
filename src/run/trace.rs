//! A bounded memory of the samples for charts: the whole run thinned out, its beginning and its end in full.

use super::sample::Sample;
use std::collections::VecDeque;

/// Samples kept of the whole run.
const WHOLE: usize = 2048;
/// Samples kept of the beginning and of the end.
const PART: usize = 1500;

/// The memory: samples without positions, which follow from the angles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Samples at equal distances over the whole run, and the last.
    pub whole: Vec<Sample>,
    /// The first samples, all of them.
    pub head: Vec<Sample>,
    /// The last samples, all of them.
    pub tail: VecDeque<Sample>,
    stride: u64,
    seen: u64,
}

impl Trace {
    /// Takes a sample.
    pub fn see(&mut self, sample: &Sample) {
        self.stride = self.stride.max(1);
        if self.seen.is_multiple_of(self.stride) {
            if self.whole.len() == WHOLE {
                let mut keep = false;
                self.whole.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.stride *= 2;
            }
            if self.seen.is_multiple_of(self.stride) {
                self.whole.push(thin(sample));
            }
        }
        if self.head.len() < PART {
            self.head.push(thin(sample));
        }
        if self.tail.len() == PART {
            self.tail.pop_front();
        }
        self.tail.push_back(thin(sample));
        self.seen += 1;
    }
}

/// A sample without positions and velocities.
fn thin(sample: &Sample) -> Sample {
    Sample {
        phi: sample.phi.clone(),
        omega: sample.omega.clone(),
        constraints: sample.constraints.clone(),
        motors: sample.motors.clone(),
        centre: Vec::new(),
        velocity: Vec::new(),
        ..*sample
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_bounded_and_the_whole_run_is_covered_evenly() {
        let mut trace = Trace::default();
        for i in 0..100_000 {
            trace.see(&Sample { t: f64::from(i), ..Sample::default() });
        }
        assert!(trace.whole.len() <= WHOLE && trace.whole.len() > WHOLE / 3);
        assert_eq!((trace.head.len(), trace.tail.len()), (PART, PART));
        let step = trace.whole[1].t;
        assert!(trace.whole.windows(2).all(|pair| pair[1].t - pair[0].t == step));
        assert_eq!(trace.tail.back().map(|sample| sample.t), Some(99_999.0));
    }
}
