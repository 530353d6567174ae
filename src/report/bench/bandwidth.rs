//! How fast this machine reads: a sum over a long array.
//!
//! ```text
//! rate = bytes of the array / seconds of the sum,      eight independent sums of eight lanes, so that no sum waits for another
//! ```
//!
//! An array far larger than the caches gives the rate of memory; one as large as the data of a kernel gives what that
//! kernel could be fed at, wherever its data lie. The array is cut evenly among the threads, and the fastest of a few
//! rounds counts: on one thread in seconds of the processor, where the system tells, else of the wall.

use std::hint::black_box;

use rayon::prelude::*;

use crate::clock::{self, Stopwatch};
use crate::lanes::{Kernel, LANES, Lanes, widest};

/// Bytes of the array for the rate of memory.
pub const LARGE: usize = 1 << 29;

/// Bytes read in all: small arrays are read more often.
const VOLUME: usize = 1 << 32;

/// Rounds of which the fastest counts.
const ROUNDS: usize = 5;

/// Bytes a second that the threads of the current pool read together from an array of so many bytes.
pub fn read_rate(bytes: usize) -> f64 {
    let threads = rayon::current_num_threads();
    let rows = (bytes / size_of::<Lanes>()).max(8 * threads);
    // every thread writes its part first, so that it is its own
    let array: Vec<Lanes> = (0..rows).into_par_iter().map(|row| Lanes::all(1.0 + (row % 7) as f64)).collect();
    let bytes = size_of_val(&array[..]);
    let passes = (VOLUME / ROUNDS / bytes).clamp(1, 2000);
    let part = rows.div_ceil(threads);
    let pass = |array: &[Lanes]| {
        let mut total = 0.0;
        for _ in 0..passes {
            widest(Sum(black_box(array), &mut total));
        }
        total
    };
    let least = (0..ROUNDS).fold(f64::INFINITY, |least, _| {
        let (processor, watch) = (clock::processor_seconds().filter(|_| threads == 1), Stopwatch::start());
        let total: f64 = array.par_chunks(part).map(pass).sum();
        // the sum is used, so that it cannot be left out
        assert!(black_box(total) > 0.0, "a sum of positive numbers");
        let spent = processor.zip(clock::processor_seconds()).map(|(before, after)| after - before);
        least.min(spent.unwrap_or(watch.seconds()))
    });
    (passes * bytes) as f64 / least
}

/// Adds the sum of all numbers.
struct Sum<'a>(&'a [Lanes], &'a mut f64);

impl Kernel for Sum<'_> {
    #[inline(always)]
    fn run<const REGISTERS: u8>(self) {
        let mut sums = [Lanes::ZERO; LANES];
        for rows in self.0.chunks_exact(LANES) {
            for (sum, row) in sums.iter_mut().zip(rows) {
                *sum = sum.add::<REGISTERS>(*row);
            }
        }
        *self.1 += sums.iter().flat_map(|sum| sum.0).sum::<f64>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_is_one_of_all_numbers() {
        let rows: Vec<Lanes> = (0..24).map(|row| Lanes(std::array::from_fn(|l| (8 * row + l) as f64))).collect();
        let mut total = 1.0;
        widest(Sum(&rows, &mut total));
        assert_eq!(total, 1.0 + (191 * 192 / 2) as f64);
    }
}
