//! Distances and overlaps of boxes, against values computed by hand.

use bagtrack_tracker::Rect;

#[test]
fn the_center_distance_is_that_of_the_centres() {
    // Centres (5, 5) and (8, 9): a 3-4-5 triangle.
    let (a, b) = (
        Rect::new(0.0, 0.0, 10.0, 10.0),
        Rect::new(6.0, 4.0, 4.0, 10.0),
    );
    assert_eq!(a.center_distance(&b), 5.0);
    assert_eq!(b.center_distance(&a), 5.0);
}

#[test]
fn the_overlap_is_intersection_over_union() {
    let square = Rect::new(0.0, 0.0, 10.0, 10.0);
    assert_eq!(square.overlap(&square), 1.0);
    // The intersection is 50, the union 100 + 100 - 50.
    let beside = Rect::new(5.0, 0.0, 10.0, 10.0);
    assert_eq!(square.overlap(&beside), 50.0 / 150.0);
    // One box inside the other: 25 of 100.
    assert_eq!(square.overlap(&Rect::new(1.0, 1.0, 5.0, 5.0)), 0.25);
    assert_eq!(square.overlap(&Rect::new(10.0, 0.0, 10.0, 10.0)), 0.0);
    assert_eq!(square.overlap(&Rect::new(40.0, 40.0, 10.0, 10.0)), 0.0);
}
