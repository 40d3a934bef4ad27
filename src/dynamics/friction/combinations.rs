//! What is looked at for the modes of places with friction: sets of contacts, and a mode of each place.

use super::FrictionMode;

/// The sets of contacts that may be closed: first those that stay without friction.
pub(super) fn subsets(staying: &[usize], touching: &[usize]) -> Vec<Vec<usize>> {
    let mut all = vec![staying.to_vec()];
    // More than a few would be too many.
    let few = &touching[..touching.len().min(6)];
    for bits in (0..1_usize << few.len()).rev() {
        let set: Vec<usize> =
            few.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, &contact)| contact).collect();
        if !all.contains(&set) {
            all.push(set);
        }
    }
    all
}

/// Every combination of one mode a place: by the number of places that stuck `before` and slide, then by that
/// of places that do not take their first mode.
pub(super) fn combinations(options: &[Vec<FrictionMode>], before: &[FrictionMode]) -> Vec<Vec<FrictionMode>> {
    let mut all = vec![([0_usize; 2], Vec::new())];
    for (number, of) in options.iter().enumerate() {
        let stuck = matches!(before.get(number), Some(FrictionMode::Stick(_)));
        all = all
            .iter()
            .flat_map(|([moved, later], modes)| {
                of.iter().enumerate().map(move |(i, &mode)| {
                    let moves = stuck && matches!(mode, FrictionMode::Slip(_));
                    let mut modes = modes.clone();
                    modes.push(mode);
                    ([moved + usize::from(moves), later + usize::from(i > 0)], modes)
                })
            })
            .collect();
    }
    all.sort_by_key(|(order, _)| *order);
    all.into_iter().map(|(_, modes)| modes).collect()
}
