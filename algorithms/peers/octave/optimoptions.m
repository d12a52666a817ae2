function o = optimoptions(varargin)
  o = struct(varargin{2:end});
end
