//! What is left unsaid: many parts that are each too small for a word are not small together.

/// Which of some parts, by place, are to be told of: all but the smallest, which together are no more than `most`. O(n log n).
pub(crate) fn told(parts: &[f64], most: f64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by(|a, b| parts[*a].total_cmp(&parts[*b]).then(b.cmp(a)));
    let (mut told, mut unsaid) = (vec![true; parts.len()], 0.0);
    for part in order {
        unsaid += parts[part];
        if unsaid > most {
            break;
        }
        told[part] = false;
    }
    told
}

/// Lines for people, at most.
const MOST_LINES: usize = 10;

/// The first lines, and the number of the others.
pub(crate) fn summed_up(lines: Vec<String>) -> Vec<String> {
    first(lines, MOST_LINES, |more| format!("the same holds for {more} more"))
}

/// The first lines, at most so many, and one in these words on how many more there are.
pub(crate) fn first(mut lines: Vec<String>, most: usize, words: impl FnOnce(usize) -> String) -> Vec<String> {
    let more = lines.len().saturating_sub(most);
    if more > 0 {
        lines.truncate(most);
        lines.push(words(more));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_told_of_is_small_together() {
        assert_eq!(told(&[0.5, 9.0, 0.25], 1.0), [false, true, false]);
        // Of eight, each too small by itself, two are left unsaid.
        assert_eq!(told(&[0.5; 8], 1.0).iter().filter(|told| !**told).count(), 2);
        assert!(told(&[], 1.0).is_empty());
    }

    #[test]
    fn many_lines_are_summed_up() {
        let lines = |n: usize| summed_up((0..n).map(|i| i.to_string()).collect());
        assert_eq!(lines(10).len(), 10);
        assert_eq!(lines(30).last().map(String::as_str), Some("the same holds for 20 more"));
    }
}
