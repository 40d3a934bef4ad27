//! Passes over the trees for power series, which ask the same configuration for one order after another.
//!
//! ```text
//! R = H x + (forces taken off), without the diagonal of H:    outwards  A_k = A_p + r_k x_p;
//!     inwards  G_k = c_k x_k + Σ G_j,  R_k = conj(c_k) A_k + Σ conj(r_j) G_j
//! M alpha = Q - Im(conj(z) R):     inwards   e_k = Q_k - z_k × R_k - Σ (u_j·F_j + b_j e_j),
//!     F_k = Σ (F_j + s_j e_j)          with s = h/d, b = u·s of the configuration
//!                                  outwards  alpha_k = e_k/d - s_k·a_p - b_k alpha_p,
//!                                      a_k = a_p + u_k alpha_p
//! ```
//!
//! p is what body k hangs on, and j what hangs on it; c_k = Σ m gamma_k over all bodies that k carries:
//! conj(c_k) A_k is the part of the bodies between k and the ground, and conj(r_j) G_j that of those beyond
//! hinge j.  As u_k alpha_p = r_k (i z_p alpha_p), the a are the A of what alpha adds to x.  With b formed
//! beforehand, what one body waits for of the next is one product and one sum.

use super::{Links, Recursive};
use crate::arithmetic::{Complex, Real};

/// A body's constants at a configuration.
#[derive(Clone, Copy, Debug, Default)]
struct Brace<T> {
    /// u \[m\].
    lever: Complex<T>,
    /// s \[1/m\].
    share: Complex<T>,
    /// b.
    back: T,
    /// 1/d \[1/(kg·m²)\].
    pivot: T,
}

/// What a body passes on inwards: F, u·F with its moment, G and conj(r) G.
#[derive(Clone, Copy, Debug, Default)]
struct InwardLoad<T> {
    force: Complex<T>,
    torque: T,
    carried: Complex<T>,
    felt: Complex<T>,
}

impl<T: Real> InwardLoad<T> {
    fn join(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
        self.carried += other.carried;
        self.felt += other.felt;
    }
}

/// What a body is asked for on the way inwards, element by element.
#[derive(Clone, Copy, Debug)]
pub struct InwardRequest<'a, T> {
    /// z.
    pub z: &'a [Complex<T>],
    /// x, as far as it is known.
    pub known: &'a [Complex<T>],
    /// What forces leave in R.
    pub rest: &'a [Complex<T>],
    /// Q \[N·m, N\], of the coordinates.
    pub load: &'a [T],
}

/// The passes of one configuration; nothing is allocated after [`Passes::new`].
#[derive(Clone, Debug)]
pub struct Passes<T> {
    /// Σ m gamma of the ground, then of the bodies \[kg·m\].
    carried: Vec<Complex<T>>,
    /// Likewise.
    braces: Vec<Brace<T>>,
    /// A, likewise.
    inner: Vec<Complex<T>>,
    /// a and alpha of what forks.
    forks: Vec<(Complex<T>, T)>,
    /// Sums over the bodies that hang on a fork; zero between passes.
    outer: Vec<InwardLoad<T>>,
}

impl<T: Real> Passes<T> {
    /// Scratch space for these bodies.
    pub fn new(links: &Links) -> Self {
        let n = links.bodies() + 1;
        Self {
            carried: links.carried.iter().map(|c| Complex::new(T::split(c.re).0, T::split(c.im).0)).collect(),
            braces: vec![Brace::default(); n],
            inner: vec![Complex::ZERO; n],
            forks: vec![(Complex::ZERO, T::ZERO); n],
            outer: vec![InwardLoad::default(); n],
        }
    }

    /// Takes the configuration of the last [`Recursive::inward_pass`].
    pub fn unit_vectors(&mut self, links: &Links, trees: &Recursive<T>) {
        for ((brace, place), link) in self.braces.iter_mut().zip(&trees.places).zip(&links.links).skip(1) {
            let joint = &trees.joints[link.body];
            let share = joint.moment.times(joint.pivot);
            *brace = Brace { lever: place.lever, share, back: place.lever.dot(share), pivot: joint.pivot };
        }
    }

    /// A of what is known of x, and what is left of the load, into the joints.
    #[inline]
    pub fn inward_loads(&mut self, links: &Links, trees: &mut Recursive<T>, order: InwardRequest<T>) {
        let all = &links.links[..];
        let n = all.len();
        let (carried, braces, inner) = (&self.carried[..n], &self.braces[..n], &mut self.inner[..n]);
        let (joints, forks) = (&mut trees.joints[..], &mut self.outer[..n]);
        let InwardRequest { z, known, rest, load } = order;
        let (mut at, mut last) = (Complex::ZERO, Complex::ZERO);
        for k in 1..n {
            let link = &all[k];
            if link.parent + 1 != k || k == 1 {
                (at, last) = match (link.parent, link.origin_point) {
                    (0, 0) => (Complex::ZERO, Complex::ZERO),
                    (0, origin_point) => (known[origin_point], Complex::ZERO),
                    (parent, _) => (inner[parent], known[all[parent].body]),
                };
            }
            at += last.turn(link.hinge);
            inner[k] = at;
            last = known[link.body];
        }
        let mut outer = InwardLoad::default();
        for k in (1..n).rev() {
            let (link, brace) = (&all[k], &braces[k]);
            if link.forks {
                outer = std::mem::take(&mut forks[k]);
            }
            let rest_here = rest[link.body] + inner[k] * carried[k].conj() + outer.felt;
            let excess = load[link.body] - z[link.body].cross(rest_here) - outer.torque;
            joints[link.body].excess = excess;
            let sum = outer.carried + known[link.body] * carried[k];
            let passed = InwardLoad {
                force: outer.force + brace.share.times(excess),
                torque: brace.lever.dot(outer.force) + brace.back * excess,
                carried: sum,
                felt: sum.turn(link.hinge.conj()),
            };
            if link.alone {
                outer = passed;
                continue;
            }
            if link.parent != 0 {
                forks[link.parent].join(passed);
            } else if link.origin_point != 0 {
                let x = link.origin_point;
                let force = rest[x] + passed.carried + passed.force;
                let along = load[x] - force.re;
                joints[x].excess = along;
                joints[x + 1].excess = load[x + 1] - force.im - joints[x].moment.re * along;
            }
            outer = InwardLoad::default();
        }
    }

    /// The accelerations \[rad/s², m/s²\] of what is left in the joints; their A are added to that of what is
    /// known.
    #[inline]
    pub fn outward_pass(&mut self, links: &Links, trees: &Recursive<T>, alpha: &mut [T]) {
        let all = &links.links[..];
        let n = all.len();
        let (braces, joints, inner, forks) =
            (&self.braces[..n], &trees.joints[..], &mut self.inner[..n], &mut self.forks[..n]);
        let (mut a, mut turn) = (Complex::ZERO, T::ZERO);
        for k in 1..n {
            let (link, brace) = (&all[k], &braces[k]);
            if link.parent + 1 != k || k == 1 {
                (a, turn) = if link.parent == 0 { (Complex::ZERO, T::ZERO) } else { forks[link.parent] };
            }
            if link.origin_point != 0 {
                let [x, y] = [&joints[link.origin_point], &joints[link.origin_point + 1]];
                let up = y.excess * y.pivot;
                a = Complex::new(x.excess * x.pivot - x.moment.re * up, up);
                (alpha[link.origin_point], alpha[link.origin_point + 1]) = (a.re, a.im);
            }
            let next = joints[link.body].excess * brace.pivot - brace.share.dot(a) - brace.back * turn;
            a += brace.lever.times(turn);
            turn = next;
            inner[k] += a;
            if link.forks {
                forks[k] = (a, turn);
            }
            alpha[link.body] = turn;
        }
    }

    /// Adds H x without its diagonal to `rest`, x all of it now.
    #[inline]
    pub fn close(&mut self, links: &Links, x: &[Complex<T>], rest: &mut [Complex<T>]) {
        let all = &links.links[..];
        let n = all.len();
        let (carried, inner, forks) = (&self.carried[..n], &self.inner[..n], &mut self.outer[..n]);
        let (mut sum, mut felt) = (Complex::ZERO, Complex::ZERO);
        for k in (1..n).rev() {
            let link = &all[k];
            if link.forks {
                (sum, felt) = (std::mem::take(&mut forks[k].carried), std::mem::take(&mut forks[k].felt));
            }
            rest[link.body] += inner[k] * carried[k].conj() + felt;
            sum += x[link.body] * carried[k];
            felt = sum.turn(link.hinge.conj());
            if link.alone {
                continue;
            }
            if link.parent != 0 {
                forks[link.parent].carried += sum;
                forks[link.parent].felt += felt;
            } else if link.origin_point != 0 {
                rest[link.origin_point] += sum;
            }
            (sum, felt) = (Complex::ZERO, Complex::ZERO);
        }
    }
}
