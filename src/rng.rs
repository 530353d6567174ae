//! Random streams that are a function of (seed, gamma index, chain index) and of nothing else.
//!
//! One xoshiro256++ sequence is started from the seed (D. Blackman and S. Vigna, ACM Trans. Math. Softw. 47, 2021). A
//! *long jump* skips 2^192 draws, a *jump* 2^128; problem g of a sweep starts g long jumps on, its chain c a further c jumps. Streams
//! can therefore never overlap, and no thread count or order of work can change a draw.

use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A random stream of one chain.
#[derive(Debug, Clone)]
pub struct Stream(Xoshiro256PlusPlus);

impl Stream {
    /// The stream of chain `chain` of problem `problem` (the gamma index of a sweep) under `seed`.
    pub fn new(seed: u64, problem: usize, chain: usize) -> Self {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
        (0..problem).for_each(|_| generator.long_jump());
        (0..chain).for_each(|_| generator.jump());
        Self(generator)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0.random()
    }

    /// Uniform in 0..n.
    ///
    /// # Panics
    /// When n is 0.
    pub fn below(&mut self, n: usize) -> usize {
        assert!(n > 0, "a choice among nothing");
        (self.0.next_u64() % n as u64) as usize
    }

    /// Standard normal, by the polar form of Box and Muller.
    pub fn normal(&mut self) -> f64 {
        loop {
            let (a, b) = (2.0 * self.uniform() - 1.0, 2.0 * self.uniform() - 1.0);
            let s = a * a + b * b;
            if s > 0.0 && s < 1.0 {
                return a * (-2.0 * s.ln() / s).sqrt();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ_in_seed_problem_and_chain() {
        let first = |seed, problem, chain| Stream::new(seed, problem, chain).uniform();
        assert_eq!(first(1, 2, 3), first(1, 2, 3));
        let others = [first(2, 2, 3), first(1, 3, 3), first(1, 2, 4), first(1, 3, 2)];
        assert!(others.iter().all(|&x| x != first(1, 2, 3)));
    }

    #[test]
    fn normal_draws_have_mean_zero_and_variance_one() {
        let mut stream = Stream::new(7, 0, 0);
        let draws: Vec<f64> = (0..100_000).map(|_| stream.normal()).collect();
        let mean = draws.iter().sum::<f64>() / 1e5;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / 1e5;
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.02, "{mean} {variance}");
    }
}
