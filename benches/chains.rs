use driftless::arithmetic::Complex;
use driftless::dynamics::recursive::{Hung, Links, Recursive};
use std::hint::black_box;
use std::time::Instant;
fn main() {
    for n in [2usize, 8, 32, 128, 512, 2000, 10_000] {
        let l = 1.0 / n as f64;
        let bodies: Vec<Hung> = (0..n)
            .map(|k| Hung {
                parent: k.checked_sub(1),
                hinge: Complex::new(l, 0.0),
                centre: Complex::new(l / 2.0, 0.0),
                mass: l,
                inertia: l * l * l / 12.0,
            })
            .collect();
        let links = Links::new(&bodies, Complex::new(9.81, 0.0)).unwrap();
        let mut r = Recursive::<f64>::new(&links);
        let mut phi: Vec<f64> = (0..n).map(|k| (k as f64 * 0.37).sin()).collect();
        let omega: Vec<f64> = (0..n).map(|k| (k as f64 * 0.71).cos()).collect();
        let mut alpha = vec![0.0; n];
        let reps = 200_000 / n + 5;
        let mut best = [f64::MAX; 5];
        for _ in 0..100 {
            let mut t = [0.0; 5];
            let b = Instant::now();
            for _ in 0..reps {
                r.face(black_box(&phi));
            }
            t[0] = b.elapsed().as_secs_f64();
            let b = Instant::now();
            for _ in 0..reps {
                r.convect(&links, black_box(&omega));
            }
            t[1] = b.elapsed().as_secs_f64();
            let b = Instant::now();
            for _ in 0..reps {
                black_box(&mut r).fold(&links);
            }
            t[2] = b.elapsed().as_secs_f64();
            let b = Instant::now();
            for _ in 0..reps {
                black_box(&mut r).unfold(&links, &mut alpha);
            }
            t[3] = b.elapsed().as_secs_f64();
            let b = Instant::now();
            for _ in 0..reps {
                r.accelerate(&links, black_box(&phi), &omega, &mut alpha);
                phi[0] += 1e-12 * alpha[0];
            }
            t[4] = b.elapsed().as_secs_f64();
            for i in 0..5 {
                best[i] = best[i].min(t[i] * 1e9 / (reps * n) as f64);
            }
        }
        println!("{n:6} {best:.2?} ns/body, {:.3} us", best[4] * n as f64 * 1e-3);
    }
}
