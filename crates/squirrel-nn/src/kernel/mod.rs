//! Networks over many windows at once: forward, and exact gradients by backpropagation through
//! time.
//!
//! Windows lie side by side in registers ([`simd`]); the forward pass is that of `squirrel-core`,
//! on registers. What the backward pass needs is kept on a tape. Sums over windows have one order
//! whatever the width of the registers: window `k` of a batch goes to column `k mod 16`, a column
//! takes its windows in order and each window its ticks in order, and the sixteen columns are added
//! as a tree at the end.

pub use squirrel_sim::simd;
mod tape;
#[cfg(test)]
mod tests;

use crate::heads::{Head, Sample};
use simd::{BLOCK, Kernel, Path, Paths, Register};
use squirrel_core::lane::Lane;
use squirrel_core::rnn::elman::{Elman, Hidden};
use squirrel_core::rnn::parnn::{HIDDEN, INPUTS};
use tape::Tape;

/// Parameters of a network with these outputs, or gradients by them.
pub(crate) type Net<S, const OUT: usize> = Elman<INPUTS, HIDDEN, OUT, S>;

/// Outputs of a network for each of many windows, oldest row first, of which the last `STEPS` rows
/// are seen.
///
/// The same bits as [`Elman::window`] on each of them, on every path.
///
/// # Panics
/// If a window has fewer than `STEPS` rows.
pub fn forward<const STEPS: usize, const OUT: usize, W: AsRef<[[f32; INPUTS]]>>(
    path: Path,
    net: &Elman<INPUTS, HIDDEN, OUT>,
    windows: &[W],
) -> Vec<[f32; OUT]> {
    f32::run(path, Forward::<_, _, STEPS, OUT> { net, windows })
}

/// Outputs for each window.
pub(crate) struct Forward<'a, S, W, const STEPS: usize, const OUT: usize> {
    pub(crate) net: &'a Net<S, OUT>,
    pub(crate) windows: &'a [W],
}

impl<S: Paths, W: AsRef<[[S; INPUTS]]>, const STEPS: usize, const OUT: usize> Kernel<S>
    for Forward<'_, S, W, STEPS, OUT>
{
    type Output = Vec<[S; OUT]>;

    #[inline(always)]
    fn run<L: Register<Element = S>>(self) -> Self::Output {
        let mut outputs = vec![[<S as Lane>::of(0.0); OUT]; self.windows.len()];
        for (windows, outputs) in self.windows.chunks(L::WIDTH).zip(outputs.chunks_mut(L::WIDTH)) {
            let rows = gather::<L, STEPS>(windows.iter().map(AsRef::as_ref));
            let mut hidden = Hidden::new();
            for row in &rows {
                self.net.step(&mut hidden, row);
            }
            let columns = scatter(&self.net.read(&hidden));
            for (lane, output) in outputs.iter_mut().enumerate() {
                for o in 0..OUT {
                    output[o] = columns[o][lane];
                }
            }
        }
        outputs
    }
}

/// The last rows of windows side by side; zero where there are fewer windows than lanes.
#[inline(always)]
fn gather<'a, L: Register, const STEPS: usize>(
    windows: impl Iterator<Item = &'a [[L::Element; INPUTS]]>,
) -> [[L; INPUTS]; STEPS]
where
    L::Element: 'a,
{
    let mut columns = [[[<L::Element as Lane>::of(0.0); BLOCK]; INPUTS]; STEPS];
    for (lane, window) in windows.take(L::WIDTH).enumerate() {
        let last = &window[window.len() - STEPS..];
        for t in 0..STEPS {
            for i in 0..INPUTS {
                columns[t][i][lane] = last[t][i];
            }
        }
    }
    let mut rows = [[L::of(0.0); INPUTS]; STEPS];
    for t in 0..STEPS {
        for i in 0..INPUTS {
            rows[t][i] = L::load(&columns[t][i]);
        }
    }
    rows
}

/// The numbers of each register, the first [`Register::WIDTH`] of them.
#[inline(always)]
fn scatter<L: Register, const N: usize>(registers: &[L; N]) -> [[L::Element; BLOCK]; N] {
    let mut columns = [[<L::Element as Lane>::of(0.0); BLOCK]; N];
    for n in 0..N {
        registers[n].store(&mut columns[n]);
    }
    columns
}

/// Loss over a batch, and its gradient by the parameters.
pub(crate) struct Batch<'a, S, H, const STEPS: usize, const OUT: usize> {
    pub(crate) net: &'a Net<S, OUT>,
    pub(crate) head: H,
    pub(crate) samples: &'a [Sample<S>],
    /// Which samples, not empty.
    pub(crate) members: &'a [u32],
}

impl<S: Paths, H: Head<S, OUT>, const STEPS: usize, const OUT: usize> Kernel<S>
    for Batch<'_, S, H, STEPS, OUT>
{
    /// Mean of the squared distance between force and target, N^2, and the gradient of that mean.
    type Output = (f64, Net<S, OUT>);

    #[inline(always)]
    fn run<L: Register<Element = S>>(self) -> Self::Output {
        let mut sums = vec![Net::<L, OUT>::filled(L::of(0.0)); BLOCK / L::WIDTH];
        let mut tape = Tape::<L, STEPS>::new();
        let per_window = nalgebra::convert::<f64, S>(2.0 / self.members.len() as f64);
        let mut loss = 0.0;
        for block in self.members.chunks(BLOCK) {
            for (group, sum) in sums.iter_mut().enumerate() {
                let start = block.len().min(group * L::WIDTH);
                let members = &block[start..block.len().min(start + L::WIDTH)];
                let windows = members.iter().map(|&k| self.samples[k as usize].rows.as_slice());
                let outputs = scatter(&tape.forward(self.net, gather(windows)));
                let mut pulls = [[<S as Lane>::of(0.0); BLOCK]; OUT];
                for (lane, &k) in members.iter().enumerate() {
                    let mut output = [<S as Lane>::of(0.0); OUT];
                    for o in 0..OUT {
                        output[o] = outputs[o][lane];
                    }
                    let (squared, pull) = self.head.loss(&output, &self.samples[k as usize]);
                    loss += squared;
                    for o in 0..OUT {
                        pulls[o][lane] = pull[o] * per_window;
                    }
                }
                let mut pull = [L::of(0.0); OUT];
                for o in 0..OUT {
                    pull[o] = L::load(&pulls[o]);
                }
                tape.backward(self.net, &pull, sum);
            }
        }
        (loss / self.members.len() as f64, reduce(&sums))
    }
}

/// The sum over the columns, as a tree.
#[inline(always)]
fn reduce<L: Register, const OUT: usize>(sums: &[Net<L, OUT>]) -> Net<L::Element, OUT> {
    let zero = <L::Element as Lane>::of(0.0);
    let mut total = Net::filled(zero);
    for (tensor, to) in total.tensors_mut().into_iter().enumerate() {
        for (k, to) in to.iter_mut().enumerate() {
            let mut columns = [zero; BLOCK];
            for (group, sum) in sums.iter().enumerate() {
                sum.tensors()[tensor][k].store(&mut columns[group * L::WIDTH..]);
            }
            let mut half = BLOCK / 2;
            while half > 0 {
                for c in 0..half {
                    columns[c] += columns[c + half];
                }
                half /= 2;
            }
            *to = columns[0];
        }
    }
    total
}
