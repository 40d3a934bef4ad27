//! What all teams do with eight lanes.

use super::super::terms::add_to;
use crate::arithmetic::eight::Octet;
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::lanes::wide::EightLanes;
use crate::arithmetic::sincos;

// Closures and `map` are compiled apart, without the processor's vectors, and arrays that loops go over stay
// in memory: what follows, and all that uses it, is written out.

#[inline(always)]
pub(super) fn load<W: EightLanes>(octet: &Octet) -> W {
    W::of(&octet.0)
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
    let ([high, other_high], [low, other_low]) = (load::<W>(high).halves(), load::<W>(low).halves());
    let (s, c) = sincos::sin_cos::<W::Half>(high, low);
    let (other_s, other_c) = sincos::sin_cos::<W::Half>(other_high, other_low);
    [store(W::join([c, other_c])), store(W::join([s, other_s]))]
}

/// Square roots.
#[inline(always)]
pub(super) fn root<W: EightLanes>(x: W) -> W {
    let [first, second] = x.halves();
    W::join([first.sqrt(), second.sqrt()])
}
