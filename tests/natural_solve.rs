//! Natural coordinates solved for accelerations and multipliers by full matrices, and how far a state in them
//! is from its constraints: to compare with, from what the natural form tells of itself.

use driftless::arithmetic::{Complex, DoubleDouble, Scalar};
use driftless::dynamics::constraint::RowMeasure;
use driftless::dynamics::natural::coupling::{CouplingTerms, NearestTurns};
use driftless::dynamics::natural::{Guide, Natural, times};
use driftless::dynamics::{Form, State, Time, schur, tree};

type C = Complex<f64>;

/// z'' \[1/s², m/s²\] and the multipliers \[N·m, N\] of all rows, in the order of the mechanism's, at elements
/// `z` with whole turns of the bodies and rates `rate` \[1/s, m/s\].
pub fn accelerations(
    natural: &Natural,
    t: Time,
    (z, turns): (&[C], &[i64]),
    rate: &[C],
) -> (Vec<C>, Vec<f64>) {
    let (n, bodies, rows) = (z.len(), natural.mechanism().bodies.len(), natural.rows());
    let reduced = natural.reduced();
    let spread = |x: &[C]| -> Vec<C> {
        let rows = reduced.inverse.chunks(n);
        rows.map(|row| row.iter().zip(x).fold(C::ZERO, |sum, (w, &x)| sum + times(w, x))).collect()
    };
    let mut force = vec![C::ZERO; n];
    natural.force(z, &mut force);
    let mut gradients = vec![vec![C::ZERO; n]; rows];
    let mut multiplier = vec![0.0; rows];
    for k in 0..bodies {
        gradients[k][k] = z[k];
        multiplier[k] = rate[k].norm_squared();
    }
    for (r, guide) in natural.guides().iter().enumerate() {
        guide.gradient(&guide.demand(t), z, &mut gradients[bodies + r]);
        multiplier[bodies + r] = convective(guide, t, z, rate);
    }
    let (mut whole, mut coupled) = (NearestTurns::default(), CouplingTerms::default());
    let pairs: Vec<_> = z.iter().map(|&z| Complex::of(z)).collect();
    whole.set(&pairs, &turns[..bodies]);
    coupled.evaluate(natural.couplings(), (t, &whole), z, rate);
    for (number, coupling) in natural.couplings().iter().enumerate() {
        for (gradient, &part) in
            gradients[bodies + coupling.guide].iter_mut().zip(&coupled.gradients[number * n..])
        {
            *gradient += part;
        }
        multiplier[bodies + coupling.guide] += coupled.rows[number].convective;
    }
    let free = spread(&force);
    let minv_jt: Vec<Vec<C>> = gradients.iter().map(|gradient| spread(gradient)).collect();
    let mut matrix = vec![0.0; rows * rows];
    for p in 0..rows {
        for q in p..rows {
            matrix[p * rows + q] = dot(&gradients[p], &minv_jt[q]);
        }
        multiplier[p] += dot(&gradients[p], &free);
    }
    let (mut pivot, mut scales) = (vec![0.0; rows], Vec::with_capacity(rows));
    natural.scales(&mut scales);
    schur::factor::<f64, 0>(rows, &mut matrix, &mut pivot, &scales);
    tree::solve::<f64, 0>(rows, &matrix, &pivot, &mut multiplier);
    let mut acceleration = free;
    for p in 0..rows {
        for k in 0..n {
            acceleration[k] -= minv_jt[p][k].times(multiplier[p]);
            force[k] -= gradients[p][k].times(multiplier[p]);
        }
    }
    let mut all = vec![0.0; natural.mechanism().constraints.len()];
    for (guide, multiplier) in natural.guides().iter().zip(&multiplier[bodies..]) {
        all[guide.row] = *multiplier;
    }
    for (row, back) in reduced.rows.iter().zip(reduced.back.chunks(n)) {
        all[row.row] = dot(back, &force);
    }
    (acceleration, all)
}

/// C'' of a guide at zero z'' \[rad/s² or m/s²\].
fn convective(guide: &Guide, t: Time, z: &[C], rate: &[C]) -> f64 {
    let demand = guide.demand::<f64>(t);
    let cross = 2.0 * guide.square(&demand, rate);
    match (&guide.measure, &guide.law) {
        // u' = i theta' u and u'' = (i theta'' - theta'²) u, conjugated.
        (RowMeasure::Angle { .. }, law) => {
            let acceleration = law.as_ref().map_or(0.0, |law| law.at::<f64>(t).acceleration);
            let mut ahead = demand;
            ahead.unit = demand.unit.left();
            let off = guide.mismatch(&demand, z);
            let turning = 2.0 * demand.rate * guide.slip(&ahead, z, rate);
            cross + turning - demand.rate * demand.rate * off.im - acceleration * off.re
        }
        (RowMeasure::Place(_), law) => cross - law.as_ref().map_or(0.0, |law| law.rates::<f64>(t).1),
    }
}

/// Largest of the |z_k|² - 1 and of the C of all rows \[1, rad, m\], and largest rate of these
/// \[1/s, rad/s, m/s\], in double-double.
pub fn residual(natural: &Natural, state: &State) -> [f64; 2] {
    let n = natural.elements();
    let vector = |k: usize| Complex::new(state.unknown(2 * k), state.unknown(2 * k + 1));
    let z: Vec<Complex<DoubleDouble>> = (0..n).map(vector).collect();
    let rate: Vec<Complex<DoubleDouble>> = (n..2 * n).map(vector).collect();
    let mut left = Vec::new();
    for (z, rate) in z.iter().zip(&rate).take(natural.mechanism().bodies.len()) {
        left.push([z.norm_squared() + -1.0, z.dot(*rate).ldexp(2.0)]);
    }
    for linear in &natural.reduced().rows {
        let terms = linear.place.linear.iter();
        let slip = terms.fold(DoubleDouble::ZERO, |sum, &(k, g)| sum + Complex::of(g).dot(rate[k]));
        left.push([linear.place.value(&z), slip]);
    }
    let first = left.len();
    for guide in natural.guides() {
        let demand = guide.demand::<DoubleDouble>(state.time);
        let slip = guide.slip(&demand, &z, &rate) + guide.drive(&demand, &z);
        left.push([guide.value(&demand, &z), slip]);
    }
    let (mut whole, mut coupled) = (NearestTurns::default(), CouplingTerms::default());
    whole.set(&z, &state.turns);
    coupled.evaluate(natural.couplings(), (state.time, &whole), &z, &[]);
    for (number, coupling) in natural.couplings().iter().enumerate() {
        let [position, velocity] = &mut left[first + coupling.guide];
        *position += coupled.rows[number].position;
        *velocity += coupled.slip(number, &rate) + coupled.rows[number].drive;
    }
    [0, 1].map(|level| left.iter().map(|left| left[level].hi.abs()).fold(0.0, f64::max))
}

/// Real part of Σ conj(a_k) b_k.
fn dot(a: &[C], b: &[C]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
