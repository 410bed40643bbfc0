// Coefficients of Rosenbrock methods with an embedded one for the error, both stiffly accurate and L-stable, in the
// form without products of the Jacobian (E. Hairer, G. Wanner, Solving ODEs II, section IV.7): stage i solves
//   (1/(gamma h) - J) U_i = f(t + node_i h, y + sum A_ij U_j) + sum C_ij U_j / h + h time_weight_i df/dt.
// From stage kDirect on (counted from 0) a stage starts from the one before plus its increment, and so does the
// solution, whose last increment is the error. The first kShared stages are evaluated at the start of the step.
#pragma once

namespace rod {

/// RODAS5P (G. Steinebach, BIT Numer. Math. 63:27, 2023), order 5 with embedded order 4.
struct Rodas5p {
  static constexpr int kStages = 8, kDirect = 6, kShared = 1, kOrder = 5;
  static constexpr double kGamma = 0.21193756319429014;
  static constexpr double kA[5][5] = {
      {3.0},
      {2.849394379747939, 0.45842242204463923},
      {-6.954028509809101, 2.489845061869568, -10.358996098473584},
      {2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641},
      {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946}};
  static constexpr double kC[7][7] = {
      {-14.155112264123755},
      {-17.97296035885952, -2.859693295451294},
      {147.12150275711716, -1.41221402718213, 71.68940251302358},
      {165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306},
      {24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471},
      {30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
       -28.087943162872662},
      {37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
       -54.66780262877968, -9.48861652309627}};
  static constexpr double kNode[kStages] = {
      0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1, 1, 1};
  static constexpr double kTimeWeight[kStages] = {0.21193756319429014, -0.42387512638858027, -0.3384627126235924,
                                                  1.8046452872882734, 2.325825639765069};
};

/// RODAS3 (A. Sandu et al., Atmos. Environ. 31, 3459, 1997), order 3 with embedded order 2.
struct Rodas3 {
  static constexpr int kStages = 4, kDirect = 3, kShared = 2, kOrder = 3;
  static constexpr double kGamma = 0.5;
  static constexpr double kA[2][2] = {{0.0}, {2.0, 0.0}};
  static constexpr double kC[3][3] = {{4.0}, {1.0, -1.0}, {1.0, -1.0, -8.0 / 3.0}};
  static constexpr double kNode[kStages] = {0.0, 0.0, 1.0, 1.0};
  static constexpr double kTimeWeight[kStages] = {0.5, 1.5, 0.0, 0.0};
};

inline constexpr int kMaxStages = Rodas5p::kStages;

}  // namespace rod
