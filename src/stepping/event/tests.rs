//! Derivatives of dense outputs against their bounds.

use super::*;

#[test]
fn derivatives_of_a_dense_output_keep_to_their_bounds() {
    let dense = Dense {
        powers: vec![0.3, -1.0, 0.7, 2.0, -0.4, 1.0, 0.0, -3.0, 0.0, 0.5],
        width: 5,
        off: vec![0.0; 2],
    };
    let (mut y, mut slope, mut before) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for (centre, radius) in [(0.5, 0.5), (0.3, 0.1), (0.9, 0.01)] {
        let (mut first, mut second) = ([0.0; 2], [0.0; 2]);
        dense.bounds(centre, radius, &mut first, &mut second);
        let mut most = [[0.0_f64; 2]; 2];
        for k in -50..=50 {
            let (t, h) = (centre + radius * f64::from(k) / 50.0, 1e-6);
            dense.at(t - h, &mut y, &mut before);
            dense.at(t + h, &mut y, &mut slope);
            for i in 0..2 {
                most[i] = [
                    most[i][0].max(slope[i].abs()),
                    most[i][1].max(((slope[i] - before[i]) / (2.0 * h)).abs()),
                ];
            }
        }
        for i in 0..2 {
            assert!(
                most[i][0] <= first[i] + 1e-4 && most[i][1] <= second[i] + 1e-4,
                "{most:?} {first:?} {second:?}"
            );
            assert!(radius > 0.1 || first[i] < 1.2 * most[i][0] + 0.1, "{most:?} {first:?}");
        }
    }
}
