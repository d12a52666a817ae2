function [x, f] = fmincon(of, x, A, b, Aeq, beq, lower, upper, nonlinear, options)
  [x, f] = sqp(x(:), @(y) of(y.'), [], [], lower(:), upper(:), options.MaxIter); x = x.';
end
