//! Structures of lanes, and how they lie in memory side by side.

use super::{Register, Row};

/// A structure of numbers of a vehicle: once as they are, once as [rows](Row) of a block, once as registers.
///
/// `[n]` behind a name makes it an array of `n` numbers.
#[macro_export]
macro_rules! numbers {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $field:ident $([$n:literal])?),* $(,)? }) => {
        $(#[$about])*
        #[allow(unreachable_pub, reason = "not every structure is known outside")]
        pub struct $name<X> { $($(#[$doc])* pub $field: $crate::numbers!(@type X $($n)?)),* }

        impl<X: Copy> Copy for $name<X> {}
        #[allow(clippy::expl_impl_clone_on_copy, reason = "`derive` does not look into the types of fields")]
        impl<X: Copy> Clone for $name<X> {
            #[inline(always)]
            fn clone(&self) -> Self {
                *self
            }
        }
        impl<X: PartialEq> PartialEq for $name<X> {
            fn eq(&self, other: &Self) -> bool {
                $(self.$field == other.$field)&&*
            }
        }
        impl<X: core::fmt::Debug> core::fmt::Debug for $name<X> {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.debug_struct(stringify!($name))$(.field(stringify!($field), &self.$field))*.finish()
            }
        }

        #[allow(dead_code, unreachable_pub, reason = "not every structure needs every way, nor is known outside")]
        impl<X: Copy> $name<X> {
            /// The same everywhere.
            pub fn all(x: X) -> Self {
                Self { $($field: $crate::numbers!(@all x $($n)?)),* }
            }
            /// The same numbers in another form.
            #[inline(always)]
            pub fn map<Y>(&self, f: impl Fn(X) -> Y) -> $name<Y> {
                $name { $($field: $crate::numbers!(@map self f $field $($n)?)),* }
            }
        }

        #[allow(dead_code, unreachable_pub, reason = "not every structure needs every way, nor is known outside")]
        impl<S: Copy> $name<$crate::lane::Row<S>> {
            /// Puts the numbers of a vehicle into column `lane`.
            pub fn put(&mut self, lane: usize, numbers: &$name<S>) {
                $($crate::numbers!(@put self numbers $field lane $($n)?);)*
            }
            /// The numbers in column `lane`.
            pub fn take(&self, lane: usize) -> $name<S> {
                $name { $($field: $crate::numbers!(@take self $field lane $($n)?)),* }
            }
        }

        #[allow(dead_code, unreachable_pub, reason = "not every structure needs every way, nor is known outside")]
        impl<L: $crate::lane::Register> $name<L> {
            /// Registers from column `start` and on.
            #[inline(always)]
            pub fn load(rows: &$name<$crate::lane::Row<L::Element>>, start: usize) -> Self {
                Self { $($field: $crate::numbers!(@load rows $field start $($n)?)),* }
            }
            /// Registers to column `start` and on.
            #[inline(always)]
            pub fn store(&self, rows: &mut $name<$crate::lane::Row<L::Element>>, start: usize) {
                $($crate::numbers!(@store self rows $field start $($n)?);)*
            }
        }
    };
    (@type $x:ident) => { $x };
    (@type $x:ident $n:literal) => { [$x; $n] };
    (@all $x:ident) => { $x };
    (@all $x:ident $n:literal) => { [$x; $n] };
    (@map $self:ident $f:ident $field:ident) => { $f($self.$field) };
    (@map $self:ident $f:ident $field:ident $n:literal) => { $self.$field.map(&$f) };
    (@put $self:ident $numbers:ident $field:ident $lane:ident) => { $self.$field[$lane] = $numbers.$field };
    (@put $self:ident $numbers:ident $field:ident $lane:ident $n:literal) => {
        $crate::lane::put(&mut $self.$field, $lane, $numbers.$field)
    };
    (@take $self:ident $field:ident $lane:ident) => { $self.$field[$lane] };
    (@take $self:ident $field:ident $lane:ident $n:literal) => { $crate::lane::take(&$self.$field, $lane) };
    (@load $rows:ident $field:ident $start:ident) => { <L as $crate::lane::Register>::load(&$rows.$field[$start..]) };
    (@load $rows:ident $field:ident $start:ident $n:literal) => { $crate::lane::load(&$rows.$field, $start) };
    (@store $self:ident $rows:ident $field:ident $start:ident) => {
        $crate::lane::Register::store($self.$field, &mut $rows.$field[$start..])
    };
    (@store $self:ident $rows:ident $field:ident $start:ident $n:literal) => {
        $crate::lane::store(&$self.$field, &mut $rows.$field, $start)
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
pub fn store<L: Register, const N: usize>(registers: &[L; N], rows: &mut [Row<L::Element>; N], start: usize) {
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
