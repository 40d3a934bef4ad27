//! Numbers there are series of.

use super::{Series, bodywise};
use crate::arithmetic::{Complex, DoubleDouble, Dual, Real};
use crate::dynamics::{Mechanism, Time};

/// A number whose series are compiled with this crate, once, and not anew wherever they are used.
pub trait Coefficient: Real {
    /// Power zero, and the laws' series.
    fn begin(series: &mut Series<Self>, t: Time, u: &[Self], u_rest: &[Self], u_rate: &[Self]);

    /// The powers from `first` on.
    fn orders(series: &mut Series<Self>, mechanism: &Mechanism, first: usize);

    /// Writes `Σ_j a_j b_{m-j}` component by component, over series of `n` elements with m+1 powers each, for
    /// as many elements as there are sums.
    fn products(n: usize, a: &[Complex<Self>], b: &[Complex<Self>], sums: &mut [Complex<Self>]);
}

macro_rules! coefficient {
    ($number:ty, $products:path, $orders:expr $(, const $size:ident)?) => {
        impl $(<const $size: usize>)? Coefficient for $number {
            fn begin(series: &mut Series<Self>, t: Time, u: &[Self], u_rest: &[Self], u_rate: &[Self]) {
                series.begin(t, u, u_rest, u_rate);
            }

            fn orders(series: &mut Series<Self>, mechanism: &Mechanism, first: usize) {
                $orders(series, mechanism, first);
            }

            #[inline]
            fn products(n: usize, a: &[Complex<Self>], b: &[Complex<Self>], sums: &mut [Complex<Self>]) {
                $products(n, a, b, sums);
            }
        }
    };
}

coefficient!(f64, bodywise::products_in_lanes, Series::sized_orders);
coefficient!(DoubleDouble, bodywise::products, Series::sized_orders);
// The series of a motion with those of small differences beside it: one size of code is enough of each.
coefficient!(Dual<D>, bodywise::products, Series::orders::<0>, const D);
