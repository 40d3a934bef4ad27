//! Polylines: cut at the frame, broken where data have no place, dashed, thinned.
//!
//! Plotters moves points outside a panel to its border, which bends the line; here lines are clipped (Liang
//! and Barsky, "A new concept and method for line clipping", ACM Transactions on Graphics 3, 1984).

/// A place on the page \[pt from the upper left, y downwards\], or in a panel as fractions of its sides.
pub(crate) type Point = [f64; 2];

/// The pieces of a line inside the unit square; points without a place break it.
pub(crate) fn clip(points: impl IntoIterator<Item = Point>) -> Vec<Vec<Point>> {
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    let mut last: Option<Point> = None;
    // Whether the last piece ends at `last`, so that the next segment continues it.
    let mut open = false;
    for point in points {
        if !(point[0].is_finite() && point[1].is_finite()) {
            last = None;
            open = false;
            continue;
        }
        if let Some(from) = last {
            match segment(from, point) {
                Some((start, end, leaves)) => {
                    match pieces.last_mut() {
                        Some(piece) if open => piece.push(end),
                        _ => pieces.push(vec![start, end]),
                    }
                    open = !leaves;
                }
                None => open = false,
            }
        }
        last = Some(point);
    }
    pieces
}

/// The part of a segment inside the unit square, and whether it leaves the square before its end.
fn segment(from: Point, to: Point) -> Option<(Point, Point, bool)> {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for k in 0..2 {
        let step = to[k] - from[k];
        for (speed, room) in [(-step, from[k]), (step, 1.0 - from[k])] {
            if speed == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if speed < 0.0 {
                enter = enter.max(room / speed);
            } else {
                leave = leave.min(room / speed);
            }
        }
    }
    let at = |s: f64| [from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1])];
    let start = if enter == 0.0 { from } else { at(enter) };
    let end = if leave == 1.0 { to } else { at(leave) };
    (enter <= leave && start.iter().chain(&end).all(|c| c.is_finite())).then_some((start, end, leave < 1.0))
}

/// A polyline cut into dashes: lengths drawn and left out by turns \[same unit as the points\].
pub(crate) fn dashes(points: &[Point], pattern: &[f64]) -> Vec<Vec<Point>> {
    if pattern.is_empty() || pattern.iter().sum::<f64>() <= 0.0 {
        return vec![points.to_vec()];
    }
    let mut out = Vec::new();
    let (mut k, mut left) = (0, pattern[0]);
    let mut dash: Vec<Point> = points.first().map(|&p| vec![p]).unwrap_or_default();
    for pair in points.windows(2) {
        let length = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let share = done / length;
            let at = [
                pair[0][0] + share * (pair[1][0] - pair[0][0]),
                pair[0][1] + share * (pair[1][1] - pair[0][1]),
            ];
            if k % 2 == 0 {
                dash.push(at);
                out.push(std::mem::take(&mut dash));
            } else {
                dash = vec![at];
            }
            k = (k + 1) % pattern.len();
            left = pattern[k];
        }
        left -= length - done;
        if k % 2 == 0 {
            dash.push(pair[1]);
        }
    }
    if dash.len() > 1 {
        out.push(dash);
    }
    out
}

/// Largest magnitude up to each sample; samples that are not numbers are skipped, infinite ones end the line.
pub(crate) fn running_maximum(time: &[f64], values: &[f64]) -> Vec<Point> {
    let mut largest = 0.0_f64;
    let mut out: Vec<Point> = Vec::new();
    for (&t, &value) in time.iter().zip(values) {
        if value.is_nan() || !t.is_finite() {
            continue;
        }
        largest = largest.max(value.abs());
        // Within a level only its ends are needed, and its first positive time, where a logarithmic axis
        // begins.
        let level = out.len() >= 2
            && out[out.len() - 1][1] == largest
            && out[out.len() - 2][1] == largest
            && out[out.len() - 2][0] > 0.0;
        match out.last_mut() {
            Some(end) if level => end[0] = t,
            _ => out.push([t, largest]),
        }
    }
    out
}

/// Smallest and largest y in and beside each of `columns` equal parts of 0…1: `(x, low, high)` of those that
/// hold points.
pub(crate) fn envelope(points: &[Point], columns: usize) -> Vec<(f64, f64, f64)> {
    let mut range: Vec<Option<(f64, f64)>> = vec![None; columns];
    for [x, y] in points.iter().copied().filter(|[x, y]| (0.0..=1.0).contains(x) && y.is_finite()) {
        let column = &mut range[((x * columns as f64) as usize).min(columns - 1)];
        *column = Some(column.map_or((y, y), |(low, high)| (y.min(low), y.max(high))));
    }
    let middle = |k: usize| (k as f64 + 0.5) / columns as f64;
    // Neighbours are taken in, or a column that happens to miss a peak would notch the band.
    let wide = |k: usize| {
        let near = range[k.saturating_sub(1)..(k + 2).min(columns)].iter().flatten();
        near.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), r| (low.min(r.0), high.max(r.1)))
    };
    (0..columns).filter(|&k| range[k].is_some()).map(|k| (middle(k), wide(k).0, wide(k).1)).collect()
}

/// How often a line turns up or down by more than a hundredth of the panel, less than which cannot be seen.
pub(crate) fn turns(points: &[Point]) -> usize {
    let mut turns = 0_usize;
    let (mut extreme, mut rising) = (points.first().map_or(0.0, |p| p[1]), true);
    for &[_, y] in points {
        let ahead = if rising { y - extreme } else { extreme - y };
        if ahead > 0.0 {
            extreme = y;
        } else if ahead < -0.01 {
            turns += 1;
            rising = !rising;
            extreme = y;
        }
    }
    turns
}

/// Whether a line over `width` points of paper turns so often that only its envelope can be seen.
pub(crate) fn is_dense(points: &[Point], width: f64) -> bool {
    turns(points) as f64 > width / 2.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_at_the_frame_without_bending() {
        let pieces = clip([[0.5, 0.5], [0.75, 1.5], [1.0, 0.5]]);
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0][1], [0.625, 1.0]);
        assert_eq!(pieces[1][0], [0.875, 1.0]);
        assert_eq!(clip([[0.1, 0.1], [f64::NAN, 0.2], [0.3, 0.3], [0.4, 0.4]]).len(), 1);
        assert!(clip([[-1.0, 0.0], [0.5, 2.0], [0.6, 9.0]]).is_empty());
        assert_eq!(clip([[-1.0, 0.5], [2.0, 0.5]]), [[[0.0, 0.5], [1.0, 0.5]]]);
    }

    #[test]
    fn dashes_follow_the_arc_length() {
        let cut = dashes(&[[0.0, 0.0], [5.0, 0.0], [5.0, 5.0]], &[4.0, 3.0]);
        assert_eq!(cut[0], [[0.0, 0.0], [4.0, 0.0]]);
        assert_eq!(cut[1], [[5.0, 2.0], [5.0, 5.0]]);
    }

    #[test]
    fn a_running_maximum_never_falls_and_skips_gaps() {
        let line = running_maximum(&[0.0, 1.0, 2.0, 3.0, 4.0], &[0.0, -2.0, f64::NAN, 1.0, 3.0]);
        assert_eq!(line, [[0.0, 0.0], [1.0, 2.0], [3.0, 2.0], [4.0, 3.0]]);
        let level = running_maximum(&[0.0, 1.0, 2.0, 3.0, 4.0], &[5.0; 5]);
        assert_eq!(level, [[0.0, 5.0], [1.0, 5.0], [4.0, 5.0]], "a level keeps its first positive time");
    }

    #[test]
    fn fast_oscillation_is_dense_and_slow_is_not() {
        let wave = |turns: f64| {
            (0..4000).map(|k| [k as f64 / 4000.0, (turns * k as f64 / 4000.0).sin()]).collect::<Vec<_>>()
        };
        assert!(!is_dense(&wave(100.0), 360.0));
        assert!(is_dense(&wave(3000.0), 360.0));
    }
}
