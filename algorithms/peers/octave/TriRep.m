function t = TriRep(F, varargin)
  t = struct('F', F);
end
