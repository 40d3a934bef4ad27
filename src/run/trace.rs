//! A bounded memory of the samples for charts: the whole run thinned out, its beginning and its end in full.

use super::sample::Sample;
use std::collections::VecDeque;

/// Samples kept of the whole run.
const WHOLE: usize = 2048;
/// Samples kept of the beginning and of the end.
const PART: usize = 1500;
/// Numbers of a sample beyond which fewer are kept.
const MANY: usize = 1024;
/// Samples that are kept however large they are.
const LEAST: usize = 64;

/// The memory: samples without positions, which follow from the angles.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
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
    /// All samples kept.
    pub(super) fn samples(&self) -> impl Iterator<Item = &Sample> {
        self.whole.iter().chain(&self.head).chain(&self.tail)
    }

    /// Takes a sample.
    pub fn see(&mut self, sample: &Sample) {
        let fewer = ((2 * sample.phi.len() + 4 * sample.constraints.len()) / MANY).max(1);
        let [whole, part] = [WHOLE, PART].map(|count| (count / fewer).max(LEAST));
        if self.seen == 0 {
            // All of it at once, and no more: a long run shall not ask for more than a short one.
            self.whole.reserve_exact(whole);
            self.head.reserve_exact(part);
            self.tail.reserve_exact(part);
            self.stride = 1;
        }
        if self.seen.is_multiple_of(self.stride) {
            if self.whole.len() == whole {
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
        if self.head.len() < part {
            self.head.push(thin(sample));
        }
        // The oldest one's room serves the newest.
        let mut last = if self.tail.len() == part { self.tail.pop_front() } else { None }.unwrap_or_default();
        last.thin_from(sample);
        self.tail.push_back(last);
        self.seen += 1;
    }
}

/// A sample without positions and velocities.
fn thin(sample: &Sample) -> Sample {
    let mut thinned = Sample::default();
    thinned.thin_from(sample);
    thinned
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
