use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x: [_; 40])]
struct Stops {
    m: f64,
}

#[dynamics]
impl Stops {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for x in q.x {
            sum += 0.5 * self.m * x.dt().powi(2);
        }
        sum
    }

    #[holonomic(switched)]
    fn stop0(&self, q: &Coordinates<Self>) -> Expr {
        q.x[0]
    }

    #[holonomic(switched)]
    fn stop1(&self, q: &Coordinates<Self>) -> Expr {
        q.x[1]
    }

    #[holonomic(switched)]
    fn stop2(&self, q: &Coordinates<Self>) -> Expr {
        q.x[2]
    }

    #[holonomic(switched)]
    fn stop3(&self, q: &Coordinates<Self>) -> Expr {
        q.x[3]
    }

    #[holonomic(switched)]
    fn stop4(&self, q: &Coordinates<Self>) -> Expr {
        q.x[4]
    }

    #[holonomic(switched)]
    fn stop5(&self, q: &Coordinates<Self>) -> Expr {
        q.x[5]
    }

    #[holonomic(switched)]
    fn stop6(&self, q: &Coordinates<Self>) -> Expr {
        q.x[6]
    }

    #[holonomic(switched)]
    fn stop7(&self, q: &Coordinates<Self>) -> Expr {
        q.x[7]
    }

    #[holonomic(switched)]
    fn stop8(&self, q: &Coordinates<Self>) -> Expr {
        q.x[8]
    }

    #[holonomic(switched)]
    fn stop9(&self, q: &Coordinates<Self>) -> Expr {
        q.x[9]
    }

    #[holonomic(switched)]
    fn stop10(&self, q: &Coordinates<Self>) -> Expr {
        q.x[10]
    }

    #[holonomic(switched)]
    fn stop11(&self, q: &Coordinates<Self>) -> Expr {
        q.x[11]
    }

    #[holonomic(switched)]
    fn stop12(&self, q: &Coordinates<Self>) -> Expr {
        q.x[12]
    }

    #[holonomic(switched)]
    fn stop13(&self, q: &Coordinates<Self>) -> Expr {
        q.x[13]
    }

    #[holonomic(switched)]
    fn stop14(&self, q: &Coordinates<Self>) -> Expr {
        q.x[14]
    }

    #[holonomic(switched)]
    fn stop15(&self, q: &Coordinates<Self>) -> Expr {
        q.x[15]
    }

    #[holonomic(switched)]
    fn stop16(&self, q: &Coordinates<Self>) -> Expr {
        q.x[16]
    }

    #[holonomic(switched)]
    fn stop17(&self, q: &Coordinates<Self>) -> Expr {
        q.x[17]
    }

    #[holonomic(switched)]
    fn stop18(&self, q: &Coordinates<Self>) -> Expr {
        q.x[18]
    }

    #[holonomic(switched)]
    fn stop19(&self, q: &Coordinates<Self>) -> Expr {
        q.x[19]
    }

    #[holonomic(switched)]
    fn stop20(&self, q: &Coordinates<Self>) -> Expr {
        q.x[20]
    }

    #[holonomic(switched)]
    fn stop21(&self, q: &Coordinates<Self>) -> Expr {
        q.x[21]
    }

    #[holonomic(switched)]
    fn stop22(&self, q: &Coordinates<Self>) -> Expr {
        q.x[22]
    }

    #[holonomic(switched)]
    fn stop23(&self, q: &Coordinates<Self>) -> Expr {
        q.x[23]
    }

    #[holonomic(switched)]
    fn stop24(&self, q: &Coordinates<Self>) -> Expr {
        q.x[24]
    }

    #[holonomic(switched)]
    fn stop25(&self, q: &Coordinates<Self>) -> Expr {
        q.x[25]
    }

    #[holonomic(switched)]
    fn stop26(&self, q: &Coordinates<Self>) -> Expr {
        q.x[26]
    }

    #[holonomic(switched)]
    fn stop27(&self, q: &Coordinates<Self>) -> Expr {
        q.x[27]
    }

    #[holonomic(switched)]
    fn stop28(&self, q: &Coordinates<Self>) -> Expr {
        q.x[28]
    }

    #[holonomic(switched)]
    fn stop29(&self, q: &Coordinates<Self>) -> Expr {
        q.x[29]
    }

    #[holonomic(switched)]
    fn stop30(&self, q: &Coordinates<Self>) -> Expr {
        q.x[30]
    }

    #[holonomic(switched)]
    fn stop31(&self, q: &Coordinates<Self>) -> Expr {
        q.x[31]
    }

    #[holonomic(switched)]
    fn stop32(&self, q: &Coordinates<Self>) -> Expr {
        q.x[32]
    }
}

fn main() {}
