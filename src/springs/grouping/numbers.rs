//! Springs that need the same number: the groups of a network whose stiffness is known.

use super::super::network::Network;
use super::{Group, Grouping};

/// Numbers this near to each other, relative, are one.
const SAME: f64 = 1e-9;

/// Sorts springs into classes, and those of a class by the number that each needs, from the smallest; returns the groups and
/// their numbers. A class with several numbers has as many groups, counted from 1 behind its name.
///
/// # Panics
/// When there is not one number and one class for every spring, or a class has no name.
pub fn by_numbers(network: &Network, numbers: &[f64], class_of: &[u32], names: &[String]) -> (Grouping, Vec<f64>) {
    assert_eq!(
        [numbers.len(), class_of.len()],
        [network.springs.len(); 2],
        "one number and one class for every spring"
    );
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    let key = |s: usize, r: usize| numbers[s].total_cmp(&numbers[r]).then(s.cmp(&r));
    order.sort_by(|&s, &r| class_of[s].cmp(&class_of[r]).then(key(s, r)));
    let (mut phi, mut class_of_group): (Vec<f64>, Vec<u32>) = (vec![], vec![]);
    let mut groups: Vec<Group> = Vec::new();
    let mut group_of = vec![0; order.len()];
    for s in order {
        let (class, number) = (class_of[s], numbers[s]);
        let goes_on =
            class_of_group.last() == Some(&class) && phi.last().is_some_and(|last| number <= last * (1.0 + SAME));
        if !goes_on {
            phi.push(number);
            class_of_group.push(class);
            groups.push(Group { name: names[class as usize].clone(), springs: 0, length: 0.0 });
        }
        group_of[s] = groups.len() as u32 - 1;
        if let Some(group) = groups.last_mut() {
            group.springs += 1;
            group.length += (network.springs[s].length - group.length) / group.springs as f64;
        }
    }
    count(&mut groups, &class_of_group);
    (Grouping { group_of, groups }, phi)
}

/// Puts the numbers of groups behind names that several have.
fn count(groups: &mut [Group], class_of_group: &[u32]) {
    let mut first = 0;
    for of_class in class_of_group.chunk_by(|a, b| a == b) {
        if of_class.len() > 1 {
            for (i, group) in groups[first..first + of_class.len()].iter_mut().enumerate() {
                group.name += &format!("_{}", i + 1);
            }
        }
        first += of_class.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::dofs::DofMap;
    use crate::geometry::grid::Grid;
    use crate::springs::topology;

    #[test]
    fn classes_come_in_their_order_and_are_counted_where_they_have_several_numbers() {
        let positions = [[0.0; 3], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
        let dofs = DofMap::untied(2, &[[false; 3]; 4]);
        let network = (topology::find("grid").expect("in the table").connect)(&Grid::new(&[2, 2]), &positions, &dofs);
        assert_eq!(network.springs.len(), 6);
        let names = ["soft".to_owned(), "hard".to_owned()];
        let numbers = [5.0, 7.0, 1.0, 5.0 * (1.0 + 1e-12), 0.0, 7.0];
        let (grouping, phi) = by_numbers(&network, &numbers, &[1, 0, 1, 1, 1, 0], &names);
        assert_eq!(grouping.group_of, [3, 0, 2, 3, 1, 0]);
        assert_eq!(phi, [7.0, 0.0, 1.0, 5.0]);
        let named: Vec<&str> = grouping.groups.iter().map(|group| group.name.as_str()).collect();
        assert_eq!(named, ["soft", "hard_1", "hard_2", "hard_3"]);
        let counts: Vec<usize> = grouping.groups.iter().map(|group| group.springs).collect();
        assert_eq!(counts, [2, 1, 1, 2]);
        let mean = (network.springs[0].length + network.springs[3].length) / 2.0;
        assert!((grouping.groups[3].length - mean).abs() < 1e-15);
    }
}
