!----------------------------------------------------------------------
! The smooth Duffing oscillator, forced: one period as a boundary-value problem.
!   x'' + 2 zeta x' + x + x^3 = A cos(w t),  U = (x, v), s in [0,1], t = s 2 pi/w
!   NDIM=2 + 1 for time, NBC=3  ->  one free parameter: w
!   PAR: 1 w  2 zeta  3 A
!----------------------------------------------------------------------
SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)
  IMPLICIT NONE
  INTEGER, INTENT(IN) :: NDIM, IJAC, ICP(*)
  DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
  DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
  DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM,*), DFDP(NDIM,*)
  DOUBLE PRECISION TP,ACC
  ! U(3) is the phase w t over one period
  TP=2*ACOS(-1.d0)/PAR(1)
  ACC=-2*PAR(2)*U(2)-U(1)-U(1)**3+PAR(3)*COS(U(3))
  F(1)=TP*U(2)
  F(2)=TP*ACC
  F(3)=2*ACOS(-1.d0)
  IF(IJAC==0)RETURN
  DFDU(1:3,1:3)=0.d0
  DFDU(1,2)=TP
  DFDU(2,1)=TP*(-1.d0-3*U(1)**2)
  DFDU(2,2)=-2*TP*PAR(2)
  DFDU(2,3)=-TP*PAR(3)*SIN(U(3))
  IF(IJAC==1)RETURN
  DFDP(1:3,1:3)=0.d0
  DFDP(1,1)=-TP/PAR(1)*U(2)
  DFDP(2,1)=-TP/PAR(1)*ACC
  DFDP(2,2)=-2*TP*U(2)
  DFDP(2,3)=TP*COS(U(3))
END SUBROUTINE FUNC

SUBROUTINE STPNT(NDIM,U,PAR,T)
  IMPLICIT NONE
  INTEGER, INTENT(IN) :: NDIM
  DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
  DOUBLE PRECISION, INTENT(IN) :: T
  DOUBLE PRECISION P,G,C,S
  PAR(1:10)=0.d0
  PAR(1)=3.d0; PAR(2)=0.05d0; PAR(3)=0.3d0
  ! the response of the linear oscillator, near enough far above resonance
  P=2*ACOS(-1.d0)*T
  G=1.d0-PAR(1)**2; C=2*PAR(2)*PAR(1); S=PAR(3)/(G*G+C*C)
  U(1)=S*(G*COS(P)+C*SIN(P))
  U(2)=S*PAR(1)*(-G*SIN(P)+C*COS(P))
  U(3)=P
END SUBROUTINE STPNT

SUBROUTINE BCND(NDIM,PAR,ICP,NBC,U0,U1,FB,IJAC,DBC)
  IMPLICIT NONE
  INTEGER, INTENT(IN) :: NDIM, ICP(*), NBC, IJAC
  DOUBLE PRECISION, INTENT(IN) :: PAR(*), U0(NDIM), U1(NDIM)
  DOUBLE PRECISION, INTENT(OUT) :: FB(NBC)
  DOUBLE PRECISION, INTENT(INOUT) :: DBC(NBC,*)
  FB(1)=U1(1)-U0(1)
  FB(2)=U1(2)-U0(2)
  FB(3)=U0(3)
  IF(IJAC==0)RETURN
  DBC(1:NBC,1:6)=0.d0
  DBC(1,1)=-1.d0; DBC(1,4)=1.d0
  DBC(2,2)=-1.d0; DBC(2,5)=1.d0
  DBC(3,3)=1.d0
  IF(IJAC==1)RETURN
  DBC(1:NBC,7:9)=0.d0
END SUBROUTINE BCND

SUBROUTINE ICND
END SUBROUTINE ICND
SUBROUTINE FOPT
END SUBROUTINE FOPT
SUBROUTINE PVLS
END SUBROUTINE PVLS
