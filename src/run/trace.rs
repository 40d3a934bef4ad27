//! A bounded memory of the samples for charts: the whole run thinned out, its beginning and its end in full,
//! and a window of it where one is wanted.

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

/// Samples at equal distances, fewer of them the longer it goes on.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
struct Thinned {
    stride: u64,
    seen: u64,
}

impl Thinned {
    /// Takes a sample, and halves the samples where there are `most` already.
    fn see(&mut self, samples: &mut Vec<Sample>, sample: &Sample, most: usize) {
        if self.seen == 0 {
            // All of it at once, and no more: a long run shall not ask for more than a short one.
            samples.reserve_exact(most);
            self.stride = 1;
        }
        if self.seen.is_multiple_of(self.stride) {
            if samples.len() == most {
                let mut keep = false;
                samples.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.stride *= 2;
            }
            if self.seen.is_multiple_of(self.stride) {
                samples.push(thin(sample));
            }
        }
        self.seen += 1;
    }
}

/// The memory: samples without positions, which follow from the angles.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Trace {
    /// Samples at equal distances over the whole run.
    pub whole: Vec<Sample>,
    /// From when to when charts show the run \[s\].
    pub window: Option<[f64; 2]>,
    /// Samples of the window, at equal distances.
    pub part: Vec<Sample>,
    /// The first samples, all of them.
    pub head: Vec<Sample>,
    /// The last samples, all of them.
    pub tail: VecDeque<Sample>,
    thinned: [Thinned; 2],
}

impl Trace {
    /// All samples kept.
    pub(super) fn samples(&self) -> impl Iterator<Item = &Sample> {
        self.whole.iter().chain(&self.part).chain(&self.head).chain(&self.tail)
    }

    /// Takes a sample.
    pub fn see(&mut self, sample: &Sample) {
        let fewer = ((2 * sample.phi.len() + 4 * sample.constraints.len()) / MANY).max(1);
        let [whole, part] = [WHOLE, PART].map(|count| (count / fewer).max(LEAST));
        if self.head.is_empty() {
            self.head.reserve_exact(part);
            self.tail.reserve_exact(part);
        }
        let [of_whole, of_window] = &mut self.thinned;
        of_whole.see(&mut self.whole, sample, whole);
        if self.window.is_some_and(|[from, to]| (from..=to).contains(&sample.t)) {
            of_window.see(&mut self.part, sample, whole);
        }
        if self.head.len() < part {
            self.head.push(thin(sample));
        }
        // The oldest one's room serves the newest.
        let mut last = if self.tail.len() == part { self.tail.pop_front() } else { None }.unwrap_or_default();
        last.thin_from(sample);
        self.tail.push_back(last);
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
        let mut trace = Trace { window: Some([50_000.0, 50_100.0]), ..Trace::default() };
        for i in 0..100_000 {
            trace.see(&Sample { t: f64::from(i), ..Sample::default() });
        }
        assert!(trace.whole.len() <= WHOLE && trace.whole.len() > WHOLE / 3);
        assert_eq!((trace.head.len(), trace.tail.len()), (PART, PART));
        assert_eq!((trace.part.len(), trace.part[0].t), (101, 50_000.0));
        let step = trace.whole[1].t;
        assert!(trace.whole.windows(2).all(|pair| pair[1].t - pair[0].t == step));
        assert_eq!(trace.tail.back().map(|sample| sample.t), Some(99_999.0));
    }
}
