//! Constants of both laws, and how a law accesses its constants.

use std::fmt::Debug;

use specgen_ir::constants;
use specgen_ir::description::description;
use specgen_ir::scalar::Numbers as _;
use specgen_ir::{Ir, LEGS};
use specgen_law::{ControlLaw, Reset, Spec, StateOf};
use specgen_runtime::snapshot::Sizes;
use specgen_runtime::supervisor::Supervision;
use specgen_runtime::{Dac, Legs, PermittedRange, Real};

use crate::InvalidIr;
use crate::convert::Convert;
use crate::memory::{Memory, Table, at_rest, models};

/// A scalar type of a controller.
pub trait Number: Real + Debug + Send + Sync + 'static {}
impl<T: Real + Debug + Send + Sync + 'static> Number for T {}

/// All constants of a spec of one law.
pub trait Constants: Debug + Send + Sync + Sized + 'static {
    type Real: Number;
    type Law: ControlLaw<AtRunTime<Self>>;
    fn common(&self) -> &Common<Self::Real>;
    /// Switches on the optional parts of the spec.
    fn complete(&self, state: &mut StateOf<AtRunTime<Self>>);
}

/// A reference to the constants, for the law.
#[derive(Debug)]
pub struct AtRunTime<C: 'static>(pub &'static C);

impl<C> Clone for AtRunTime<C> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C> Copy for AtRunTime<C> {}

impl<C> PartialEq for AtRunTime<C> {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.0, other.0)
    }
}

/// Accessors: name, type, and the value of `$constants`.
macro_rules! accessors {
    ($constants:ident => $($name:ident -> $type:ty = $value:expr;)+) => {
        $(
            #[inline(always)]
            fn $name(&self) -> $type {
                let $constants = self.0;
                $value
            }
        )+
    };
}

/// The additional constants of a law, each with name, type and value. The law gets a value (`copy`), a reference (`lend`), an optional
/// reference (`maybe`), or nothing (`own`).
macro_rules! law_constants {
    (@accessor own $field:ident: $kind:ty) => {};
    (@accessor copy $field:ident: $kind:ty) => {
        #[inline(always)]
        fn $field(&self) -> $kind {
            self.0.$field
        }
    };
    (@accessor lend $field:ident: $kind:ty) => {
        #[inline(always)]
        fn $field(&self) -> &$kind {
            &self.0.$field
        }
    };
    (@accessor maybe $field:ident: $kind:ty as $lent:ty) => {
        #[inline(always)]
        fn $field(&self) -> $lent {
            self.0.$field.as_ref()
        }
    };
    (
        $(#[$about:meta])*
        $name:ident: $trait:ident { $(type $type:ident = $is:ty;)+ }
        of ($convert:ident $(, $part:ident: $of:ty)*);
        $($how:ident $field:ident: $kind:ty $(as $lent:ty)? = $value:expr;)+
    ) => {
        $(#[$about])*
        #[derive(Debug)]
        pub struct $name<T: Real> {
            common: Common<T>,
            $($field: $kind,)+
        }

        impl<T: Number> $trait for AtRunTime<$name<T>> {
            $(type $type = $is;)+
            $(law_constants!(@accessor $how $field: $kind $(as $lent)?);)+
        }

        impl<T: Number> $name<T> {
            fn new(common: Common<T>, $convert: &Convert<T> $(, $part: $of)*) -> Result<Self, InvalidIr> {
                Ok(Self { common, $($field: $value),+ })
            }
        }
    };
}
pub(crate) use law_constants;

impl<C: Constants> Spec for AtRunTime<C> {
    type Real = C::Real;
    type Law = C::Law;
    type Table = Table<C::Real>;
    type Memory = Memory<C::Real>;

    accessors! { constants =>
        tables -> &[Table<C::Real>; LEGS] = &constants.common().tables;
        dac -> &Dac<C::Real> = &constants.common().dac;
        supervision -> &Supervision<C::Real> = &constants.common().supervision;
        raw_limits -> &[[C::Real; 2]; 6] = &constants.common().raw_limits;
        readings_per_leg -> &[[C::Real; LEGS]; 6] = &constants.common().readings_per_leg;
        geometry -> &Legs<'_, C::Real> = &constants.common().geometry;
        inverse_jacobian -> &[[C::Real; LEGS]; 6] = &constants.common().inverse_jacobian;
        corrections -> usize = constants.common().corrections;
        pose_bound -> &[C::Real; 6] = &constants.common().pose_bound;
        permitted -> &[(PermittedRange<C::Real>, usize)] = &constants.common().permitted;
        sizes -> Sizes = constants.common().sizes;
        is_identified -> bool = constants.common().identified;
    }

    fn reset(&self) -> Reset<Self> {
        let common = self.0.common();
        Reset { memory: *common.memory, displacement: common.displacement, code: common.code }
    }
}

/// The constants, the state of legs at reset, and the controller's description.
#[derive(Debug)]
pub struct Common<T: Real> {
    pub tables: [Table<T>; LEGS],
    pub dac: Dac<T>,
    pub supervision: Supervision<T>,
    pub raw_limits: [[T; 2]; 6],
    pub readings_per_leg: [[T; LEGS]; 6],
    pub geometry: Legs<'static, T>,
    pub inverse_jacobian: [[T; LEGS]; 6],
    pub corrections: usize,
    pub pose_bound: [T; 6],
    pub permitted: Vec<(PermittedRange<T>, usize)>,
    pub sizes: Sizes,
    pub identified: bool,
    /// At reset.
    pub memory: Box<[Memory<T>; LEGS]>,
    pub displacement: [T; LEGS],
    pub code: i32,
    /// The spec's settings.
    pub settings: Vec<u64>,
    /// See [`host_sim::controller::Engine::text`]; without the words of a machine.
    pub text: String,
}

impl<T: Real + Debug> Common<T> {
    pub fn new(ir: &Ir, convert: &Convert<T>) -> Result<Self, InvalidIr> {
        let (k, a) = (&ir.kinematics, &ir.actuation);
        let (tables, fresh) = models(convert, &ir.hysteresis)?;
        let (memory, displacement, code) = match &ir.supervision.risen {
            None => (Box::new(fresh), [T::ZERO; LEGS], a.code_min),
            Some(rest) => {
                let displacement = convert.vector(&rest.displacement);
                (Box::new(at_rest(fresh, convert, rest)), displacement, ir.supervision.rest)
            }
        };
        Ok(Self {
            tables,
            dac: constants::dac(convert, a),
            supervision: constants::supervision(convert, &ir.supervision),
            raw_limits: convert
                .matrix(&ir.task_space.as_ref().map_or([ir.bounds.sensor; 6], |task| task.sensing.raw_limits)),
            readings_per_leg: match &ir.supervision.readings_per_leg {
                Some(rows) => convert.matrix(rows),
                None => {
                    std::array::from_fn(|gauge| std::array::from_fn(|leg| if leg == gauge { T::ONE } else { T::ZERO }))
                }
            },
            geometry: constants::legs(convert, k),
            inverse_jacobian: convert.matrix(&k.inverse_jacobian),
            corrections: k.corrections as usize,
            pose_bound: convert.vector(&ir.bounds.pose),
            permitted: constants::permitted(convert, &ir.permitted),
            sizes: constants::sizes(ir),
            identified: ir.hysteresis.identified,
            memory,
            displacement,
            code,
            settings: ir.integrity.settings.clone(),
            text: description(ir),
        })
    }
}
