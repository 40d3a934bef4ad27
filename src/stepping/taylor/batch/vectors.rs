//! What all kernels do with eight lanes.

use super::super::terms::add_to;
use super::super::wide::Wide;
use crate::arithmetic::eight::Octet;
use crate::arithmetic::lanes::wide::EightLanes;
use crate::arithmetic::sincos;

// Closures and `map` are compiled apart, without the processor's vectors, and arrays that loops go over stay
// in memory: what follows, and all that uses it, is written out.

#[inline(always)]
pub(super) fn load<W: EightLanes>(octet: &Octet) -> W {
    W::of(&octet.0)
}

/// Zero in lanes that are finite, elsewhere not a number.
#[inline(always)]
pub(super) fn flaw_of<W: EightLanes>(octet: &Octet) -> W {
    let lanes = load::<W>(octet);
    lanes.sub(lanes)
}

#[inline(always)]
pub(super) fn store<W: EightLanes>(lanes: W) -> Octet {
    Octet(lanes.array())
}

/// What even and odd powers from the first on, each summed in squares of h, come to.
#[inline(always)]
pub(super) fn moved<W: EightLanes>([even, odd]: [W; 2], h: W) -> W {
    even.mul_add(h, odd).mul(h)
}

/// A number in two terms, and more.
#[inline(always)]
pub(super) fn added<W: EightLanes>([high, low]: [&Octet; 2], increment: W, rest: W) -> (Octet, Octet) {
    let [high, low] = add_to([load::<W>(high), load::<W>(low)], increment, rest);
    (store(high), store(low))
}

/// Cosine and sine of angles in two terms.
#[inline(always)]
pub(super) fn unit<W: EightLanes>(high: &Octet, low: &Octet) -> [Octet; 2] {
    let (sin, cos) = sincos::sin_cos::<W>(load(high), load(low));
    [store(cos), store(sin)]
}
/// Numbers in two terms.
#[inline(always)]
pub(super) fn pair<W: EightLanes>([high, low]: [&Octet; 2]) -> Wide<W> {
    Wide { hi: load(high), lo: load(low) }
}
