//! Where labels go: pushed apart beside a panel, or into the free space inside it.

use super::lines::Point;

/// What labels should not cover.
#[derive(Clone, Default)]
pub(crate) struct Occupied {
    /// Samples of lines and bands \[pt\].
    points: Vec<Point>,
    /// Words and symbols `[left, top, right, bottom]` \[pt\].
    boxes: Vec<[f64; 4]>,
}

impl Occupied {
    /// A line, sampled every two points.
    pub(crate) fn line(&mut self, points: &[Point]) {
        for pair in points.windows(2) {
            let length = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            let count = (0.5 * length).ceil().clamp(1.0, 500.0);
            self.points.extend((0..count as usize).map(|k| {
                let share = k as f64 / count;
                [
                    pair[0][0] + share * (pair[1][0] - pair[0][0]),
                    pair[0][1] + share * (pair[1][1] - pair[0][1]),
                ]
            }));
        }
        self.points.extend(points.last());
    }

    pub(crate) fn block(&mut self, bounds: [f64; 4]) {
        self.boxes.push(bounds);
    }

    /// How much a box would cover: half a unit a sample, fifty a collision.
    pub(crate) fn cost(&self, [left, top, right, bottom]: [f64; 4]) -> f64 {
        let covered = self
            .points
            .iter()
            .filter(|p| p[0] > left - 1.0 && p[0] < right + 1.0 && p[1] > top - 1.0 && p[1] < bottom + 1.0);
        let hit = self
            .boxes
            .iter()
            .filter(|b| b[0] < right + 1.0 && b[2] > left - 1.0 && b[1] < bottom + 1.0 && b[3] > top - 1.0);
        0.5 * covered.count() as f64 + 50.0 * hit.count() as f64
    }

    /// Samples nearer than `distance` to a place.
    pub(crate) fn near(&self, at: Point, distance: f64) -> usize {
        self.points.iter().filter(|p| (p[0] - at[0]).hypot(p[1] - at[1]) < distance).count()
    }
}

/// Places for labels of equal height beside a panel: in the order wanted, `gap` apart, from `top` to `bottom`
/// as far as there is room.
pub(crate) fn spread(wanted: &[f64], gap: f64, top: f64, bottom: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|&a, &b| wanted[a].total_cmp(&wanted[b]));
    let gap = gap.min((bottom - top).max(0.0) / (wanted.len().max(2) - 1) as f64);
    // Labels that touch form a group around the mean of what its members want.
    let mut groups: Vec<(f64, usize)> = Vec::new();
    for (k, &index) in order.iter().enumerate() {
        let mut group = (wanted[index] - k as f64 * gap, 1);
        while let Some(&(mean, count)) = groups.last().filter(|last| last.0 > group.0) {
            groups.pop();
            group = (
                (mean * count as f64 + group.0 * group.1 as f64) / (count + group.1) as f64,
                count + group.1,
            );
        }
        groups.push(group);
    }
    let shifted = groups.iter().flat_map(|&(mean, count)| std::iter::repeat_n(mean, count));
    let highest = bottom - (wanted.len().max(1) - 1) as f64 * gap;
    let mut places = vec![0.0; wanted.len()];
    for (k, (shift, &index)) in shifted.zip(&order).enumerate() {
        places[index] = shift.max(top).min(highest.max(top)) + k as f64 * gap;
    }
    places
}

/// The best box of `size` beside a point inside `room`, and what it costs.  `avoid` are directions in
/// which lines leave the point \[unit vectors, y downwards\].  Boxes are tried in so many rings around it,
/// the first of them at `distance`.
pub(crate) fn place(
    at: Point,
    distance: f64,
    rings: u32,
    size: [f64; 2],
    room: [f64; 4],
    avoid: &[Point],
    occupied: &Occupied,
) -> ([f64; 4], f64) {
    let mut best = ([0.0; 4], f64::INFINITY);
    for ring in 0..rings {
        for k in 0..16 {
            let angle = f64::from(k) * std::f64::consts::PI / 8.0;
            let (away, across) = (angle.cos(), -angle.sin());
            let far = distance + 6.0 * f64::from(ring);
            // The box touches the circle with the side or corner that faces the point.
            let centre = [at[0] + away * (far + 0.5 * size[0]), at[1] + across * (far + 0.5 * size[1])];
            let bounds = [
                centre[0] - 0.5 * size[0],
                centre[1] - 0.5 * size[1],
                centre[0] + 0.5 * size[0],
                centre[1] + 0.5 * size[1],
            ];
            let outside =
                [room[0] - bounds[0], room[1] - bounds[1], bounds[2] - room[2], bounds[3] - room[3]];
            let overhang = outside.iter().any(|&part| part > 0.0);
            let along: f64 = avoid.iter().map(|d| (d[0] * away + d[1] * across).max(0.0).powi(2)).sum();
            let preference = 0.4 * f64::from(k.min(16 - k)) / 8.0 + 3.0 * f64::from(ring) / f64::from(rings);
            let cost = preference + 4.0 * along + occupied.cost(bounds) + if overhang { 500.0 } else { 0.0 };
            if cost < best.1 {
                best = (bounds, cost);
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_pushed_apart_in_order_and_stay_inside() {
        let places = spread(&[50.0, 51.0, 10.0, 99.0], 12.0, 5.0, 95.0);
        assert!((places[1] - places[0] - 12.0).abs() < 1e-9, "{places:?}");
        assert!((places[0] - 44.5).abs() < 1e-9);
        assert_eq!(places[2], 10.0);
        assert_eq!(places[3], 95.0);
        let crowded = spread(&[0.0; 20], 12.0, 0.0, 95.0);
        assert!(crowded.iter().all(|place| (0.0..=95.0 + 1e-9).contains(place)));
        assert!(spread(&[], 12.0, 0.0, 1.0).is_empty());
    }

    #[test]
    fn a_label_avoids_lines_and_other_labels() {
        let mut occupied = Occupied::default();
        occupied.line(&[[50.0, 50.0], [100.0, 50.0]]);
        let (bounds, _) =
            place([50.0, 50.0], 4.0, 2, [20.0, 8.0], [0.0, 0.0, 100.0, 100.0], &[[1.0, 0.0]], &occupied);
        assert_eq!(occupied.cost(bounds), 0.0);
        occupied.block(bounds);
        let (other, _) = place([50.0, 50.0], 4.0, 2, [20.0, 8.0], [0.0, 0.0, 100.0, 100.0], &[], &occupied);
        assert!(
            other[0] >= bounds[2] || other[2] <= bounds[0] || other[1] >= bounds[3] || other[3] <= bounds[1]
        );
    }
}
