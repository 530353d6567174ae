//! Free stretches of a workspace, so that updates of fronts lie where earlier ones have gone.

/// Free stretches by their start, as (start, size).
#[derive(Default)]
pub struct Gaps {
    free: Vec<(usize, usize)>,
}

impl Gaps {
    /// The start of a stretch of `size` that is not used; `end` of the workspace moves when no gap is large enough.
    pub fn take(&mut self, size: usize, end: &mut usize) -> usize {
        if size == 0 {
            return *end;
        }
        match self.free.iter().position(|gap| gap.1 >= size) {
            Some(index) => {
                let (start, room) = self.free[index];
                if room == size {
                    self.free.remove(index);
                } else {
                    self.free[index] = (start + size, room - size);
                }
                start
            }
            None => {
                // a gap at the end grows
                let start = match self.free.last() {
                    Some(&(start, room)) if start + room == *end => {
                        self.free.pop();
                        start
                    }
                    _ => *end,
                };
                *end = start + size;
                start
            }
        }
    }

    /// Gives a stretch back and joins it with its neighbours.
    pub fn give(&mut self, start: usize, size: usize) {
        if size == 0 {
            return;
        }
        let at = self.free.partition_point(|gap| gap.0 < start);
        self.free.insert(at, (start, size));
        if at + 1 < self.free.len() && start + size == self.free[at + 1].0 {
            self.free[at].1 += self.free.remove(at + 1).1;
        }
        if at > 0 && self.free[at - 1].0 + self.free[at - 1].1 == start {
            self.free[at - 1].1 += self.free.remove(at).1;
        }
    }

    /// Takes over the gaps of others, who are done.
    pub fn inherit(&mut self, others: Gaps) {
        others.free.into_iter().for_each(|(start, size)| self.give(start, size));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_of_the_workspace_never_overlap_and_gaps_are_used_again() {
        let (mut gaps, mut end) = (Gaps::default(), 0);
        let (a, b, c) = (gaps.take(4, &mut end), gaps.take(6, &mut end), gaps.take(2, &mut end));
        assert_eq!((a, b, c, end), (0, 4, 10, 12));
        gaps.give(a, 4);
        gaps.give(b, 6);
        assert_eq!((gaps.take(7, &mut end), gaps.take(3, &mut end), end), (0, 7, 12));
        gaps.give(c, 2);
        assert_eq!((gaps.take(5, &mut end), end), (10, 15));
        assert_eq!((gaps.take(0, &mut end), end), (15, 15));
    }

    #[test]
    fn gaps_of_others_are_joined_with_neighbours() {
        let (mut one, mut other, mut end) = (Gaps::default(), Gaps::default(), 0);
        let (a, b) = (one.take(3, &mut end), other.take(5, &mut end));
        one.give(a, 3);
        other.give(b, 5);
        one.inherit(other);
        assert_eq!((one.take(8, &mut end), end), (0, 8));
    }
}
