# Eigen, SUNDIALS and, for tests, GoogleTest: installed ones where there are any, else pinned releases checked by hash.
# Without network name unpacked sources with -DFETCHCONTENT_SOURCE_DIR_EIGEN=... and -DFETCHCONTENT_SOURCE_DIR_SUNDIALS=...
include(FetchContent)
if(POLICY CMP0135)
  cmake_policy(SET CMP0135 NEW)  # unpacked files are as old as the download
endif()

FetchContent_Declare(eigen
  URL https://gitlab.com/libeigen/eigen/-/archive/3.4.0/eigen-3.4.0.tar.gz
  URL_HASH SHA256=8586084f71f9bde545ee7fa6d00288b264a2b7ac3607b974e54d13e7162c1c72
  SOURCE_SUBDIR headers-only)  # a folder that does not exist: Eigen's own build is not wanted
FetchContent_Declare(sundials
  URL https://github.com/LLNL/sundials/releases/download/v6.4.1/sundials-6.4.1.tar.gz
  URL_HASH SHA256=7bf10a8d2920591af3fba2db92548e91ad60eb7241ab23350a9b1bc51e05e8d0)
FetchContent_Declare(googletest
  URL https://github.com/google/googletest/archive/refs/tags/v1.14.0.tar.gz
  URL_HASH SHA256=8ad598c73ad796e0d8280b082cebd82a630d73e73cd3c70057938a6501bba5d7)

find_package(Eigen3 3.4 QUIET NO_MODULE)
set(TCA_EIGEN "${Eigen3_VERSION} (installed)")
if(NOT TARGET Eigen3::Eigen)
  set(TCA_EIGEN "from pinned source")
  FetchContent_MakeAvailable(eigen)
  add_library(fetched_eigen INTERFACE)
  add_library(Eigen3::Eigen ALIAS fetched_eigen)
  target_include_directories(fetched_eigen SYSTEM INTERFACE "${eigen_SOURCE_DIR}")
endif()

find_package(SUNDIALS QUIET)
if(SUNDIALS_FOUND AND SUNDIALS_VERSION VERSION_LESS 6.4)
  message(FATAL_ERROR "SUNDIALS ${SUNDIALS_VERSION} is installed, 6.4 or newer is needed.\n"
                      "-DCMAKE_DISABLE_FIND_PACKAGE_SUNDIALS=ON builds the pinned release instead.")
endif()
set(TCA_SUNDIALS "${SUNDIALS_VERSION} (installed)")
if(NOT TARGET SUNDIALS::arkode_static)
  set(TCA_SUNDIALS "from pinned source")
  foreach(part BUILD_SHARED_LIBS BUILD_CVODES BUILD_IDAS BUILD_KINSOL BUILD_BENCHMARKS BUILD_TESTING
               EXAMPLES_ENABLE_C EXAMPLES_ENABLE_CXX EXAMPLES_INSTALL SUNDIALS_TEST_UNITTESTS)
    set(${part} OFF CACHE BOOL "of SUNDIALS" FORCE)
  endforeach()
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
  FetchContent_MakeAvailable(sundials)
  unset(CMAKE_POSITION_INDEPENDENT_CODE)
endif()

if(TCA_BUILD_TESTS)
  find_package(GTest QUIET)
  if(NOT TARGET GTest::gtest_main)
    FetchContent_MakeAvailable(googletest)
  endif()
endif()
