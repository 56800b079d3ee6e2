//! The order in which any-hit rays visit children: by probability of occlusion over cost, or near to far. Which is
//! faster depends on the scene, so both are measured. Answers are the same.

/// One of so many batches is traced in the order that takes more steps, to measure it again.
const PERIOD: u32 = 16;

/// Smaller batches are not measured.
const MIN_RAYS: usize = 16;

/// An order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AnyHitOrder {
    /// By probability of occlusion over cost, highest first.
    Occlusion,
    /// Near to far, as for closest hits.
    Distance,
}

/// How many nodes and leaves rays visit in both orders.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MeasuredOrders {
    /// Moving averages of nodes and leaves per ray.
    steps: [Option<f32>; 2],
    batches: u32,
}

impl MeasuredOrders {
    /// The order of the next batch.
    pub fn next(&mut self) -> AnyHitOrder {
        self.batches = self.batches.wrapping_add(1);
        let is_distance_faster = match self.steps {
            [Some(occlusion), Some(distance)] => distance < occlusion,
            [occlusion, _] => occlusion.is_some(),
        };
        let explores = self.batches.is_multiple_of(PERIOD);
        if is_distance_faster != explores { AnyHitOrder::Distance } else { AnyHitOrder::Occlusion }
    }

    /// Adds the nodes and leaves that a batch visited.
    pub fn add(&mut self, order: AnyHitOrder, rays: usize, steps: u32) {
        if rays >= MIN_RAYS {
            let steps = steps as f32 / rays as f32;
            let average = &mut self.steps[order as usize];
            *average = Some(average.map_or(steps, |average| average + (steps - average) / 8.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_batches_have_the_order_with_fewer_steps() {
        for faster in [AnyHitOrder::Occlusion, AnyHitOrder::Distance] {
            let mut orders = MeasuredOrders::default();
            let chosen = (0..160).filter(|_| {
                let order = orders.next();
                orders.add(order, 100, if order == faster { 700 } else { 900 });
                order == faster
            });
            assert!((148..=150).contains(&chosen.count()), "{faster:?}");
        }
    }

    #[test]
    fn the_choice_follows_a_change() {
        let mut orders = MeasuredOrders::default();
        let mut trace = |cost: [u32; 2], batches: usize| {
            let mut last = AnyHitOrder::Occlusion;
            for _ in 0..batches {
                last = orders.next();
                orders.add(last, 128, cost[last as usize]);
            }
            last
        };
        assert_eq!(trace([1_000, 2_000], 161), AnyHitOrder::Occlusion);
        assert_eq!(trace([4_000, 2_000], 161), AnyHitOrder::Distance);
    }
}
