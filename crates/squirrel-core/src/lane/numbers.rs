//! Structures of lanes, and how they lie in memory side by side.

use super::{Register, Row};

/// A structure of numbers of a vehicle: once as they are, once as [rows](Row) of a block, once as
/// registers.
///
/// `[n]` behind a name makes it an array of `n` numbers, `[n] [m]` one of `n` arrays of `m`.
/// `<ROTORS>` behind the structure's name is a length that its user chooses.
#[macro_export]
macro_rules! numbers {
    ($(#[$about:meta])* $name:ident $(<$rotors:ident>)? {
        $($(#[$doc:meta])* $field:ident $([$n:tt] $([$m:tt])?)?),* $(,)?
    }) => {
        $(#[$about])*
        #[allow(unreachable_pub, reason = "not every structure is known outside")]
        pub struct $name<X $(, const $rotors: usize)?> { $($(#[$doc])* pub $field: $crate::numbers!(@type X $($n $($m)?)?)),* }

        impl<X: Copy $(, const $rotors: usize)?> Copy for $name<X $(, $rotors)?> {}
        #[allow(clippy::expl_impl_clone_on_copy, reason = "`derive` does not look into the types of fields")]
        impl<X: Copy $(, const $rotors: usize)?> Clone for $name<X $(, $rotors)?> {
            #[inline(always)]
            fn clone(&self) -> Self {
                *self
            }
        }
        impl<X: PartialEq $(, const $rotors: usize)?> PartialEq for $name<X $(, $rotors)?> {
            fn eq(&self, other: &Self) -> bool {
                $(self.$field == other.$field)&&*
            }
        }
        impl<X: core::fmt::Debug $(, const $rotors: usize)?> core::fmt::Debug for $name<X $(, $rotors)?> {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.debug_struct(stringify!($name))$(.field(stringify!($field), &self.$field))*.finish()
            }
        }

        #[allow(dead_code, unreachable_pub, reason = "not every structure needs every way, nor is known outside")]
        impl<X: Copy $(, const $rotors: usize)?> $name<X $(, $rotors)?> {
            /// The same everywhere.
            pub fn all(x: X) -> Self {
                Self { $($field: $crate::numbers!(@all x $($n $($m)?)?)),* }
            }
            /// The same numbers in another form.
            #[inline(always)]
            pub fn map<Y>(&self, f: impl Fn(X) -> Y) -> $name<Y $(, $rotors)?> {
                $name { $($field: $crate::numbers!(@map self f $field $($n $($m)?)?)),* }
            }
        }

        #[allow(dead_code, unreachable_pub, reason = "not every structure needs every way, nor is known outside")]
        impl<S: Copy $(, const $rotors: usize)?> $name<$crate::lane::Row<S> $(, $rotors)?> {
            /// Puts the numbers of a vehicle into column `lane`.
            pub fn put(&mut self, lane: usize, numbers: &$name<S $(, $rotors)?>) {
                $($crate::numbers!(@put self numbers $field lane $($n $($m)?)?);)*
            }
            /// The numbers in column `lane`.
            pub fn take(&self, lane: usize) -> $name<S $(, $rotors)?> {
                $name { $($field: $crate::numbers!(@take self $field lane $($n $($m)?)?)),* }
            }
        }

        #[allow(dead_code, unreachable_pub, reason = "not every structure needs every way, nor is known outside")]
        impl<L: $crate::lane::Register $(, const $rotors: usize)?> $name<L $(, $rotors)?> {
            /// Registers from column `start` and on.
            #[inline(always)]
            pub fn load(rows: &$name<$crate::lane::Row<L::Element> $(, $rotors)?>, start: usize) -> Self {
                Self { $($field: $crate::numbers!(@load rows $field start $($n $($m)?)?)),* }
            }
            /// Registers to column `start` and on.
            #[inline(always)]
            pub fn store(&self, rows: &mut $name<$crate::lane::Row<L::Element> $(, $rotors)?>, start: usize) {
                $($crate::numbers!(@store self rows $field start $($n $($m)?)?);)*
            }
        }
    };
    (@type $x:ident) => { $x };
    (@type $x:ident $n:tt) => { [$x; $n] };
    (@type $x:ident $n:tt $m:tt) => { [[$x; $m]; $n] };
    (@all $x:ident) => { $x };
    (@all $x:ident $n:tt) => { [$x; $n] };
    (@all $x:ident $n:tt $m:tt) => { [[$x; $m]; $n] };
    (@map $self:ident $f:ident $field:ident) => { $f($self.$field) };
    (@map $self:ident $f:ident $field:ident $n:tt) => { $self.$field.map(&$f) };
    (@map $self:ident $f:ident $field:ident $n:tt $m:tt) => { $self.$field.map(|numbers| numbers.map(&$f)) };
    (@put $self:ident $numbers:ident $field:ident $lane:ident) => { $self.$field[$lane] = $numbers.$field };
    (@put $self:ident $numbers:ident $field:ident $lane:ident $n:tt) => {
        $crate::lane::put(&mut $self.$field, $lane, $numbers.$field)
    };
    (@put $self:ident $numbers:ident $field:ident $lane:ident $n:tt $m:tt) => {
        for n in 0..$n {
            $crate::lane::put(&mut $self.$field[n], $lane, $numbers.$field[n]);
        }
    };
    (@take $self:ident $field:ident $lane:ident) => { $self.$field[$lane] };
    (@take $self:ident $field:ident $lane:ident $n:tt) => { $crate::lane::take(&$self.$field, $lane) };
    (@take $self:ident $field:ident $lane:ident $n:tt $m:tt) => {
        core::array::from_fn(|n| $crate::lane::take(&$self.$field[n], $lane))
    };
    (@load $rows:ident $field:ident $start:ident) => { <L as $crate::lane::Register>::load(&$rows.$field[$start..]) };
    (@load $rows:ident $field:ident $start:ident $n:tt) => { $crate::lane::load(&$rows.$field, $start) };
    (@load $rows:ident $field:ident $start:ident $n:tt $m:tt) => {{
        let mut registers = [[L::of(0.0); $m]; $n];
        for n in 0..$n {
            registers[n] = $crate::lane::load(&$rows.$field[n], $start);
        }
        registers
    }};
    (@store $self:ident $rows:ident $field:ident $start:ident) => {
        $crate::lane::Register::store($self.$field, &mut $rows.$field[$start..])
    };
    (@store $self:ident $rows:ident $field:ident $start:ident $n:tt) => {
        $crate::lane::store(&$self.$field, &mut $rows.$field, $start)
    };
    (@store $self:ident $rows:ident $field:ident $start:ident $n:tt $m:tt) => {
        for n in 0..$n {
            $crate::lane::store(&$self.$field[n], &mut $rows.$field[n], $start);
        }
    };
}

/// Registers from columns `start` and on of rows.
#[inline(always)]
pub fn load<L: Register, const N: usize>(rows: &[Row<L::Element>; N], start: usize) -> [L; N] {
    let mut registers = [L::of(0.0); N];
    for n in 0..N {
        registers[n] = L::load(&rows[n][start..]);
    }
    registers
}

/// Registers to columns `start` and on of rows.
#[inline(always)]
pub fn store<L: Register, const N: usize>(
    registers: &[L; N],
    rows: &mut [Row<L::Element>; N],
    start: usize,
) {
    for n in 0..N {
        registers[n].store(&mut rows[n][start..]);
    }
}

/// Puts numbers into column `lane`.
pub fn put<S: Copy, const N: usize>(rows: &mut [Row<S>; N], lane: usize, numbers: [S; N]) {
    for n in 0..N {
        rows[n][lane] = numbers[n];
    }
}

/// The numbers in column `lane`.
pub fn take<S: Copy, const N: usize>(rows: &[Row<S>; N], lane: usize) -> [S; N] {
    core::array::from_fn(|n| rows[n][lane])
}
