//! Random numbers: one seed makes one scene.

/// SplitMix64 (S. Vigna).
#[derive(Clone, Debug)]
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Positive, its logarithm uniform.
    pub fn size(&mut self, low: f64, high: f64) -> f64 {
        (low.ln() + (high / low).ln() * self.within(0.0, 1.0)).exp()
    }

    /// The same with either sign.
    pub fn signed(&mut self, low: f64, high: f64) -> f64 {
        let size = self.size(low, high);
        if self.chance(0.5) { size } else { -size }
    }

    /// One of 0 … count - 1.
    pub fn pick(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    pub fn chance(&mut self, share: f64) -> bool {
        self.within(0.0, 1.0) < share
    }

    pub fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.pick(of.len())]
    }

    /// A unit vector.
    pub fn direction(&mut self) -> [f64; 2] {
        let (s, c) = self.within(-std::f64::consts::PI, std::f64::consts::PI).sin_cos();
        [c, s]
    }

    /// A random order of 0 … count - 1.
    pub fn order(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for k in (1..count).rev() {
            order.swap(k, self.pick(k + 1));
        }
        order
    }
}
