//! Principal axis of a symmetric 3x3 tensor.

use glam::DVec3;

/// Sum of the outer products of unit vectors with themselves, by its six distinct entries.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tensor {
    xx: f64,
    yy: f64,
    zz: f64,
    xy: f64,
    xz: f64,
    yz: f64,
}

impl Tensor {
    pub fn add(&mut self, t: DVec3) {
        self.xx += t.x * t.x;
        self.yy += t.y * t.y;
        self.zz += t.z * t.z;
        self.xy += t.x * t.y;
        self.xz += t.x * t.z;
        self.yz += t.y * t.z;
    }

    /// Unit eigenvector of the largest eigenvalue, its component of largest magnitude positive; zero for the
    /// zero tensor. Cyclic Jacobi rotations (Golub and Van Loan, Matrix Computations, 8.5).
    pub fn principal_axis(&self) -> DVec3 {
        let mut a = [[self.xx, self.xy, self.xz], [self.xy, self.yy, self.yz], [self.xz, self.yz, self.zz]];
        let trace = self.xx + self.yy + self.zz;
        if trace <= 0.0 {
            return DVec3::ZERO;
        }
        let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for _sweep in 0..16 {
            if a[0][1].abs() + a[0][2].abs() + a[1][2].abs() <= 1e-15 * trace {
                break;
            }
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                rotate(&mut a, &mut v, p, q);
            }
        }
        let k = (1..3).fold(0, |k, i| if a[i][i] > a[k][k] { i } else { k });
        let axis = DVec3::new(v[0][k], v[1][k], v[2][k]).normalize();
        let m = axis.abs();
        let lead = if m.x >= m.y && m.x >= m.z {
            axis.x
        } else if m.y >= m.z {
            axis.y
        } else {
            axis.z
        };
        if lead < 0.0 { -axis } else { axis }
    }
}

/// One rotation that zeroes a[p][q]; `v` collects the rotations.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for k in 0..3 {
        let (kp, kq) = (a[k][p], a[k][q]);
        a[k][p] = c * kp - s * kq;
        a[k][q] = s * kp + c * kq;
    }
    for k in 0..3 {
        let (pk, qk) = (a[p][k], a[q][k]);
        a[p][k] = c * pk - s * qk;
        a[q][k] = s * pk + c * qk;
    }
    for row in v.iter_mut() {
        let (kp, kq) = (row[p], row[q]);
        row[p] = c * kp - s * kq;
        row[q] = s * kp + c * kq;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn axis_of_one_line_is_that_line_and_of_two_is_their_bisector() {
        let t = DVec3::new(-2.0, 1.0, 0.5).normalize();
        let mut m = Tensor::default();
        m.add(t);
        m.add(-t);
        assert!((m.principal_axis() + t).length() < 1e-14, "sign follows the largest component");
        let mut two = Tensor::default();
        two.add(DVec3::X);
        two.add(DVec3::new(0.8, 0.6, 0.0));
        // Half of the angle of 36.87 degrees between them.
        let half = 0.5 * 0.6f64.atan2(0.8);
        assert!((two.principal_axis() - DVec3::new(half.cos(), half.sin(), 0.0)).length() < 1e-14);
        assert_eq!(Tensor::default().principal_axis(), DVec3::ZERO);
    }

    #[test]
    fn no_other_direction_has_a_larger_moment() {
        let unit = |r: &mut Rng| loop {
            let v = DVec3::new(r.f64() - 0.5, r.f64() - 0.5, r.f64() - 0.5);
            if v.length() > 0.05 && v.length() < 0.5 {
                return v.normalize();
            }
        };
        for case in 0..200 {
            let mut r = Rng::keyed(&[11, case]);
            let lines: Vec<DVec3> = (0..1 + case % 7).map(|_| unit(&mut r)).collect();
            let mut m = Tensor::default();
            lines.iter().for_each(|&t| m.add(t));
            let moment = |d: DVec3| lines.iter().map(|t| t.dot(d).powi(2)).sum::<f64>();
            let best = moment(m.principal_axis());
            for _ in 0..200 {
                assert!(moment(unit(&mut r)) <= best + 1e-12);
            }
        }
    }
}
