//! A linear model of faces from which one person is left out.

use strandbench_scenes::face::{FaceModel, FaceSpec, Identity};
use strandbench_solve::Pca;

#[test]
fn no_person_is_in_a_model_that_leaves_the_person_out() {
    let model = FaceModel::embedded();
    let people: Vec<_> = (0..24)
        .map(|identity| {
            let spec = FaceSpec { identity, ..FaceSpec::default() };
            Identity::draw(model, &spec).unwrap().control
        })
        .collect();
    let all = Pca::fit(&people, None).unwrap();
    let without = Pca::fit(&people, Some(7)).unwrap();
    assert_eq!((all.modes.len(), without.modes.len()), (23, 22));
    let inside = all.error_mm(&people[7]).unwrap();
    let outside = without.error_mm(&people[7]).unwrap();
    println!("inside {inside:.6} mm, left out {outside:.3} mm");
    // Coordinates reach 250 mm, where a float's half unit is 8e-6 mm; mean, mode and sum each round.
    assert!(inside < 1e-4, "{inside}");
    assert!(outside > 0.1, "{outside}");
}
