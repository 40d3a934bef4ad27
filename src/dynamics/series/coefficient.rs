//! Numbers there are series of, and what the equations of a mechanism are to them.

use super::factors::Factored;
use super::{Series, bodywise, drive};
use crate::arithmetic::lanes::wide::SlotTask;
use crate::arithmetic::{Complex, DoubleDouble, Dual, Over, Real};
use crate::dynamics::compile::Body;
use crate::dynamics::constraint::ConstraintEquation;
use crate::dynamics::force::{AppliedAction, CompiledSpring, Torsion, UserForce};
use crate::dynamics::forest::Forest;
use crate::dynamics::friction::CompiledFriction;
use crate::dynamics::law::{Law, Phase};
use crate::dynamics::partition::CoordinatePartition;
use crate::dynamics::tree::Tree;
use crate::dynamics::{Mechanism, Time};

/// The terms of the equations of motion, with constants of the kind `C`.
#[derive(Clone, Copy, Debug)]
pub struct Terms<'a, C> {
    /// The mechanism they are of, for all that is not a constant of theirs.
    pub structure: &'a Mechanism,
    /// The hinge trees.
    pub tree: &'a Tree<C>,
    /// The driven angles.
    pub partition: &'a CoordinatePartition<C>,
    /// Springs and dampers.
    pub springs: &'a [CompiledSpring<C>],
    /// Torsion springs and dampers.
    pub torsions: &'a [Torsion<C>],
    /// Applied forces and torques.
    pub actions: &'a [AppliedAction<C>],
    /// Forces by formulas and from outside the crate.
    pub forces: &'a [UserForce<C>],
    /// Constraint equations.
    pub constraints: &'a [ConstraintEquation<C>],
    /// Dry friction, where there is any.
    pub friction: Option<FrictionTerms<'a, C>>,
}

/// What dry friction follows from.
#[derive(Clone, Copy, Debug)]
pub struct FrictionTerms<'a, C> {
    /// The places it acts at, in the modes of the mechanism.
    pub places: &'a [CompiledFriction<C>],
    /// The bodies, which need forces.
    pub bodies: &'a [Body<C>],
    /// How they hang.
    pub forest: &'a Forest<C>,
    /// Gravity \[m/s²\].
    pub gravity: Complex<C>,
}

impl Mechanism {
    /// Its terms, with its own constants.
    pub fn terms(&self) -> Terms<'_, f64> {
        Terms {
            structure: self,
            tree: &self.tree,
            partition: &self.partition,
            springs: &self.springs,
            torsions: &self.torsions,
            actions: &self.actions,
            forces: &self.forces,
            constraints: &self.constraints,
            friction: (!self.frictions.is_empty()).then_some(FrictionTerms {
                places: &self.frictions,
                bodies: &self.bodies,
                forest: &self.forest,
                gravity: self.gravity,
            }),
        }
    }
}

/// The constants that go with a number, and its time.
pub trait Constants: Sized {
    /// Masses, lengths and all other numbers of a scene.
    type Constant: Real;
    /// Time \[s\].
    type Time: Copy;

    /// The time as such a number \[s\].
    fn moment(t: Self::Time) -> Self;

    /// A law at a time.
    fn phase(law: &Law<Self::Constant>, t: Self::Time) -> Phase<Self>;

    /// What a law comes to at a time, turns included.
    fn law_value(law: &Law<Self::Constant>, t: Self::Time) -> Self;

    /// Adds the series of a law's rate: see `drive.rs`.
    fn add_law(
        law: &Law<Self::Constant>,
        sign: f64,
        t: Self::Time,
        series: &mut [Self],
        first: usize,
        stride: usize,
    );
}

/// A number whose series are compiled with this crate, once, and not anew wherever they are used.
pub trait SeriesNumber: Factored + Constants + Over<<Self as Constants>::Constant> {
    /// False where nobody asks for the power of motors and dampers.
    const HAS_WORK: bool = true;
    /// True where couplings between bodies are kept in the form in which they are multiplied.
    const HAS_COUPLINGS: bool = false;
    /// True where accelerations come from the inverse of M_0: an order then waits for one sum, not for passes
    /// there and back.
    const HAS_INVERSE: bool = Self::HAS_COUPLINGS;
    /// True where products with couplings are summed row by row.
    const HAS_ROWS: bool = false;
    /// True where constraint equations border that inverse, and none is ever left out.
    const HAS_BORDER: bool = false;

    /// Power zero, and the laws' series.
    fn begin(series: &mut Series<Self>, t: Self::Time, u: &[Self], u_rest: &[Self], u_rate: &[Self]);

    /// The powers from `first` on.
    fn orders(series: &mut Series<Self>, terms: &Terms<Self::Constant>, first: usize);

    /// Performs a task by itself, compiled as the numbers' orders are.
    #[inline(never)]
    fn perform<K: SlotTask>(task: K) -> K::Output {
        task.perform()
    }

    /// The sum with the product of a number and a constant that has derivatives or has not.
    #[inline(always)]
    fn with_product(self, factor: Self, constant: Self, _is_varied: bool) -> Self {
        self + factor * constant
    }

    /// The number less the product of another one and a constant.
    #[inline(always)]
    fn less_constant(self, factor: Self, constant: Self::Constant) -> Self {
        self.with_constant(factor, -constant)
    }

    /// The sum with the product of a number and a constant.
    #[inline(always)]
    fn with_constant(self, factor: Self, constant: Self::Constant) -> Self {
        self + factor.by(constant)
    }

    /// log2 of its magnitude.
    fn log2_size(self) -> f64 {
        libm::log2(self.value().abs())
    }

    /// The number kept to so many limbs, where it has limbs.
    #[inline(always)]
    fn kept(self, _limbs: usize) -> Self {
        self
    }

    /// Writes `Σ_j a_j b_{m-j}` component by component, over series of `n` elements with m+1 powers each, for
    /// as many elements as there are sums.
    fn products(n: usize, a: &[Complex<Self>], b: &[Complex<Self>], sums: &mut [Complex<Self>]);
}

/// One of those whose constants are doubles.
pub trait Coefficient: SeriesNumber + Constants<Constant = f64, Time = Time> {}

impl<T: SeriesNumber + Constants<Constant = f64, Time = Time>> Coefficient for T {}

macro_rules! coefficient {
    ($number:ty, $products:path, $orders:expr $(, const $size:ident)?) => {
        impl $(<const $size: usize>)? Constants for $number {
            type Constant = f64;
            type Time = Time;

            fn moment(t: Time) -> Self {
                Self::split(t).0
            }

            #[inline(always)]
            fn phase(law: &Law, t: Time) -> Phase<Self> {
                law.at(t)
            }

            fn law_value(law: &Law, t: Time) -> Self {
                law.value(t)
            }

            fn add_law(law: &Law, sign: f64, t: Time, series: &mut [Self], first: usize, stride: usize) {
                drive::add(law, sign, t, series, first, stride);
            }
        }

        impl $(<const $size: usize>)? Factored for $number {
            type Factor = ();
        }

        impl $(<const $size: usize>)? SeriesNumber for $number {
            fn begin(series: &mut Series<Self>, t: Time, u: &[Self], u_rest: &[Self], u_rate: &[Self]) {
                series.begin(t, u, u_rest, u_rate);
            }

            fn orders(series: &mut Series<Self>, terms: &Terms<f64>, first: usize) {
                $orders(series, terms, first);
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
